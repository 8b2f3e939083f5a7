#include "colmap_graphmatch/pipeline/pair_list.h"

#include <fstream>
#include <unordered_map>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

PairList ReadPairList(const std::filesystem::path& path, const std::vector<ImageRecord>& images) {
  std::unordered_map<std::string, ImageId> ids;
  for (const ImageRecord& image : images) ids.emplace(image.name, image.id);

  std::ifstream file(path);
  if (!file) {
    throw FileError("Cannot read the list of image pairs " + path.string() +
                    ". Does the file exist?");
  }
  PairList list;
  std::size_t line_number = 0;
  for (std::string line; std::getline(file, line);) {
    ++line_number;
    const std::size_t end = line.find_last_not_of(" \t\r");
    if (end == std::string::npos || line[0] == '#') continue;
    line.resize(end + 1);
    std::size_t num_ways = 0;
    ImagePair pair;
    const char separator = line.find('\t') != std::string::npos ? '\t' : ' ';
    for (std::size_t cut = line.find(separator); cut != std::string::npos;
         cut = line.find(separator, cut + 1)) {
      const auto first = ids.find(line.substr(0, cut));
      const auto second = ids.find(line.substr(cut + 1));
      if (first == ids.end() || second == ids.end()) continue;
      pair = ImagePair(first->second, second->second);
      ++num_ways;
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
  if (file.bad()) throw FileError("Cannot read " + path.string() + " to its end.");
  return list;
}

}  // namespace colmap_graphmatch
