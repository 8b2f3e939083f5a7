#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <unordered_map>
#include <vector>

#include "colmap_graphmatch/base/messages.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/database/database.h"

namespace colmap_graphmatch {

// A line of a text file, without the spaces at its ends.
struct Line {
  std::size_t number = 0;
  std::string text;
};

// The lines of a list, without empty ones and those that start with '#'. kind and content say in
// errors what the list is. Throws FileError if the file cannot be read or has no such line, and
// StoppedError (see ReadText).
std::vector<Line> ReadLines(const std::filesystem::path& path, const std::string& kind,
                            const std::string& content, const StopRequest* stop = nullptr);

// For files of which lines are left out: List has num_skipped and first_skipped. what: that the
// lines do not name, e.g. "an image".
template <typename List>
void WarnOfSkippedLines(const List& list, const std::filesystem::path& path,
                        const std::string& what, const Messages& messages) {
  if (list.num_skipped == 0) return;
  messages.warn(std::to_string(list.num_skipped) + " line(s) of " + path.string() +
                " that do not name " + what +
                " of the database with features are skipped; the first is \"" + list.first_skipped +
                "\".");
}

// The images with features.
std::unordered_map<std::string, ImageId> IdsByName(const std::vector<ImageRecord>& images);

}  // namespace colmap_graphmatch
