#include "colmap_graphmatch/files/pair_list.h"

#include <algorithm>
#include <unordered_map>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/files/text_file.h"

namespace colmap_graphmatch {

PairList ReadPairList(const std::filesystem::path& path, const std::vector<ImageRecord>& images,
                      const StopRequest* stop) {
  const std::unordered_map<std::string, ImageId> ids = IdsByName(images);
  std::size_t longest_name = 0;
  for (const auto& [name, id] : ids) longest_name = std::max(longest_name, name.size());
  PairList list;
  for (const auto& [line_number, line] :
       ReadLines(path, "image pairs", "two image names a line", stop)) {
    // Every way to cut it into a name, another, and what may follow, e.g. a score.
    const char separator = line.find('\t') != std::string::npos ? '\t' : ' ';
    // No two names reach further, and a line may be a whole file.
    const std::size_t end = std::min(line.size(), 2 * longest_name + 1);
    std::vector<std::size_t> cuts;
    for (std::size_t cut = line.find(separator); cut < end; cut = line.find(separator, cut + 1)) {
      cuts.push_back(cut);
    }
    if (end == line.size() || line[end] == separator) cuts.push_back(end);
    std::size_t num_ways = 0;
    ImagePair pair;
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
      const auto first = ids.find(line.substr(0, cuts[i]));
      if (first == ids.end()) continue;
      for (std::size_t j = i + 1; j < cuts.size(); ++j) {
        const auto second = ids.find(line.substr(cuts[i] + 1, cuts[j] - cuts[i] - 1));
        if (second == ids.end()) continue;
        pair = ImagePair(first->second, second->second);
        ++num_ways;
      }
    }
    if (num_ways > 1) {
      throw FileError("Line " + std::to_string(line_number) + " of " + path.string() +
                      " can be read as several pairs of images: \"" + line +
                      "\". Put a tab between the two names.");
    }
    if (num_ways == 0 || pair.id1 == pair.id2) {
      if (list.num_skipped++ == 0) list.first_skipped = line;
      continue;
    }
    list.pairs.push_back(pair);
  }
  if (list.pairs.empty()) {
    throw FileError("No line of " + path.string() +
                    " names two images with features of this database; the first is \"" +
                    list.first_skipped + "\". Are these names as in the table `images`?");
  }
  return list;
}

ImageList ReadImageList(const std::filesystem::path& path, const std::vector<ImageRecord>& images,
                        const StopRequest* stop) {
  const std::unordered_map<std::string, ImageId> ids = IdsByName(images);
  ImageList list;
  for (const Line& line : ReadLines(path, "images", "an image name a line", stop)) {
    const auto found = ids.find(line.text);
    if (found != ids.end()) {
      list.images.push_back(found->second);
    } else if (list.num_skipped++ == 0) {
      list.first_skipped = line.text;
    }
  }
  if (list.images.empty()) {
    throw FileError("No line of " + path.string() +
                    " names an image with features of this database; the first is \"" +
                    list.first_skipped + "\". Are these names as in the table `images`?");
  }
  std::sort(list.images.begin(), list.images.end());
  list.images.erase(std::unique(list.images.begin(), list.images.end()), list.images.end());
  return list;
}

}  // namespace colmap_graphmatch
