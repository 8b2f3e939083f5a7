#include "colmap_graphmatch/files/text_file.h"

#include <algorithm>
#include <string_view>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"

namespace colmap_graphmatch {

std::vector<Line> ReadLines(const std::filesystem::path& path, const std::string& kind,
                            const std::string& content, const StopRequest* stop) {
  std::string text;
  try {
    text = ReadText(path, stop);
  } catch (const UnreadableFileError& error) {
    throw FileError("Cannot read the list of " + kind + " " + path.string() + ": " +
                    error.Reason() + ". Give a file with " + content + ".");
  }
  std::vector<Line> lines;
  std::size_t number = 0;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  std::size_t next = text.compare(0, kByteOrderMark.size(), kByteOrderMark) == 0
                         ? kByteOrderMark.size()
                         : std::size_t{0};
  while (next < text.size()) {
    const std::size_t end = std::min(text.find('\n', next), text.size());
    const std::string_view line = std::string_view(text).substr(next, end - next);
    next = end + 1;
    ++number;
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || line[begin] == '#') continue;
    lines.push_back(
        {number, std::string(line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin))});
  }
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
