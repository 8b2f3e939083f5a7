// make_html_report REPORT.json PAGE.html [IMAGE_PATH]: the page of a report, with thumbnails of the
// all images that are below IMAGE_PATH, for tests of the page.

#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/report/html_report.h"
#include "colmap_graphmatch/report/thumbnails.h"

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::cerr << "make_html_report REPORT.json PAGE.html [IMAGE_PATH]\n";
    return 1;
  }
  namespace gm = colmap_graphmatch;
  std::ifstream file(argv[1], std::ios::binary);
  const std::string json{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::map<std::size_t, std::string> thumbnails;
  if (argc == 4) {
    gm::ThreadPool threads(-1);
    const gm::StopRequest stop;
    const auto names =
        nlohmann::json::parse(json).at("image_names").get<std::vector<std::string>>();
    std::vector<std::pair<std::size_t, std::string>> images;
    for (const std::string& name : names) images.emplace_back(images.size(), name);
    thumbnails = gm::MakeThumbnails(argv[3], images, threads, stop);
  }
  std::ofstream(argv[2], std::ios::binary) << gm::MakeHtmlReport(json, thumbnails);
  return 0;
}
