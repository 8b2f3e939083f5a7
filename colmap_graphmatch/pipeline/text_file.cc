#include "colmap_graphmatch/pipeline/text_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

std::vector<Line> ReadLines(const std::filesystem::path& path, const std::string& kind,
                            const std::string& content) {
  std::error_code ignored;
  std::ifstream file(path);
  const int reason = errno;
  if (!file || std::filesystem::is_directory(path, ignored)) {
    throw FileError("Cannot read the list of " + kind + " " + path.string() + ": " +
                    std::strerror(file ? EISDIR : reason) + ". Give a file with " + content + ".");
  }
  std::vector<Line> lines;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (number == 1 && line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);  // A byte order mark.
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string::npos || line[begin] == '#') continue;
    lines.push_back({number, line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin)});
  }
  if (file.bad()) throw FileError("Cannot read " + path.string() + " to its end.");
  if (lines.empty()) {
    throw FileError("The list of " + kind + " " + path.string() + " is empty.");
  }
  return lines;
}

std::unordered_map<std::string, ImageId> IdsByName(const std::vector<ImageRecord>& images) {
  std::unordered_map<std::string, ImageId> ids;
  for (const ImageRecord& image : images) {
    if (image.num_features > 0) ids.emplace(image.name, image.id);
  }
  return ids;
}

}  // namespace colmap_graphmatch
