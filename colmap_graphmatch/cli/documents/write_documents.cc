// write_documents DIRECTORY DATE: writes all that is made from the table of options to a directory.

#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <string>

#include "colmap_graphmatch/cli/documents/documents.h"

namespace {

using colmap_graphmatch::PrintBashCompletion;
using colmap_graphmatch::PrintManPage;
using colmap_graphmatch::PrintOptionsPage;
using colmap_graphmatch::PrintZshCompletion;

bool Write(const std::filesystem::path& path, const std::function<void(std::ostream&)>& print) {
  std::ofstream file(path);
  print(file);
  file.close();
  if (!file) std::cerr << "Cannot write " << path << std::endl;
  return static_cast<bool>(file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: write_documents DIRECTORY DATE" << std::endl;
    return 1;
  }
  const std::filesystem::path directory = argv[1];
  const std::string date = argv[2];
  const bool written = Write(directory / "options.md", PrintOptionsPage) &&
                       Write(directory / "graphmatch_matcher.1",
                             [&date](std::ostream& stream) { PrintManPage(stream, date); }) &&
                       Write(directory / "graphmatch_matcher.bash", PrintBashCompletion) &&
                       Write(directory / "_graphmatch_matcher", PrintZshCompletion);
  return written ? 0 : 1;
}
