#include "colmap_graphmatch/report/thumbnails.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "colmap_graphmatch/base/input_file.h"

namespace colmap_graphmatch {
namespace {

constexpr int kLongestSide = 128;  // In pixels.
constexpr int kQuality = 70;       // Of JPEG, up to 100.

// Collects images until there are enough of them.
class Choice {
 public:
  explicit Choice(std::size_t limit) : limit_(limit) {}

  void Add(std::size_t image) {
    if (images_.size() < limit_) images_.insert(image);
  }
  bool Full() const { return images_.size() >= limit_; }
  const std::set<std::size_t>& Images() const { return images_; }

 private:
  std::size_t limit_;
  std::set<std::size_t> images_;
};

void AddListedImages(const ReportDetails& details, Choice* choice) {
  const auto add_ends = [&](std::size_t edge) {
    choice->Add(details.edges[edge].a);
    choice->Add(details.edges[edge].b);
  };
  for (const ReportDetails::ImageAlone& alone : details.images_without_edge) {
    choice->Add(alone.image);
    for (const ReportDetails::Candidate& candidate : alone.candidates) choice->Add(candidate.image);
  }
  for (const Bridge& bridge : details.bridges) add_ends(bridge.edge);
  for (const ArticulationPoint& point : details.articulation_points) choice->Add(point.vertex);
  for (const WeakLink& link : details.weak_links) {
    for (const std::size_t edge : link.edges) add_ends(edge);
  }
}

// First one of every component, then the next of every component, so that none is left without.
void AddBestConnectedImages(const ReportDetails& details, Choice* choice) {
  std::vector<std::size_t> degrees(details.images.size(), 0);
  for (const GraphEdge& edge : details.edges) {
    ++degrees[edge.a];
    ++degrees[edge.b];
  }
  std::vector<std::vector<std::size_t>> components = details.components;
  for (std::vector<std::size_t>& component : components) {
    std::stable_sort(component.begin(), component.end(),
                     [&](std::size_t a, std::size_t b) { return degrees[a] > degrees[b]; });
  }
  bool any = true;
  for (std::size_t rank = 0; any && !choice->Full(); ++rank) {
    any = false;
    for (const std::vector<std::size_t>& component : components) {
      if (rank < component.size()) {
        choice->Add(component[rank]);
        any = true;
      }
    }
  }
}

// Decoding JPEG at an eighth of the size takes a fraction of the time. Of a photo that is too small
// for that, all pixels are decoded.
cv::Mat Decode(const std::vector<unsigned char>& file) {
  cv::Mat image = cv::imdecode(file, cv::IMREAD_REDUCED_COLOR_8);
  if (std::max(image.rows, image.cols) < kLongestSide) image = cv::imdecode(file, cv::IMREAD_COLOR);
  return image;
}

// Empty if there is no image in the file that can be decoded.
std::string MakeThumbnail(const std::filesystem::path& directory, const std::string& name) {
  std::vector<unsigned char> jpeg;
  try {
    cv::Mat image = Decode(ReadPhoto(directory, name));
    if (image.empty()) return "";
    const double scale = static_cast<double>(kLongestSide) / std::max(image.rows, image.cols);
    if (scale < 1) {
      const cv::Size size(std::max(1, static_cast<int>(std::lround(image.cols * scale))),
                          std::max(1, static_cast<int>(std::lround(image.rows * scale))));
      cv::resize(image, image, size, 0, 0, cv::INTER_AREA);
    }
    cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  } catch (const UnreadableFileError&) {
    return "";
  } catch (const cv::Exception&) {
    // What OpenCV says of files that are damaged or have too many pixels.
    return "";
  }
  return {jpeg.begin(), jpeg.end()};
}

}  // namespace

std::vector<std::pair<std::size_t, std::string>> ChooseThumbnails(const ReportDetails& details,
                                                                  std::size_t max_num_thumbnails) {
  const std::vector<ImageRecord>& all = details.images;
  Choice choice(max_num_thumbnails);
  if (all.size() <= max_num_thumbnails) {
    for (std::size_t i = 0; i < all.size(); ++i) choice.Add(i);
  } else {
    AddListedImages(details, &choice);
    AddBestConnectedImages(details, &choice);
  }
  std::vector<std::pair<std::size_t, std::string>> images;
  for (const std::size_t image : choice.Images()) images.emplace_back(image, all[image].name);
  return images;
}

std::map<std::size_t, std::string> MakeThumbnails(
    const std::filesystem::path& image_path,
    const std::vector<std::pair<std::size_t, std::string>>& images, ThreadPool& threads,
    const StopRequest& stop) {
  // What is wrong with a photo is told by its absence.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  std::vector<std::string> files(images.size());
  threads.ParallelFor(images.size(), [&](std::size_t i) {
    if (stop.Requested()) return;
    files[i] = MakeThumbnail(image_path, images[i].second);
  });
  std::map<std::size_t, std::string> thumbnails;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (!files[i].empty()) thumbnails.emplace(images[i].first, std::move(files[i]));
  }
  return thumbnails;
}

}  // namespace colmap_graphmatch
