#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stop_request.h"

namespace colmap_graphmatch {

// Which files of a user's are opened, and how: what is here decides it for all of the program.
// Directories, devices and sockets never are; a pipe only where a list is read, so that it can be
// made by another program (bash's <(...)).

// "Cannot read PATH: REASON."
class UnreadableFileError : public FileError {
 public:
  UnreadableFileError(const std::filesystem::path& path, const std::string& reason)
      : FileError("Cannot read " + path.string() + ": " + reason + "."), reason_(reason) {}
  const std::string& Reason() const { return reason_; }

 private:
  std::string reason_;
};

// Empty if there is a regular file (links are followed), or nothing at all; otherwise what there is
// instead, or why it cannot be looked at.
std::string WhyNotRegular(const std::filesystem::path& path);

// Throws UnreadableFileError unless it is a regular file that may be read.
std::ifstream OpenRegularFile(const std::filesystem::path& path);

// All of a regular file or of a pipe. The writer of a pipe is waited for until `stop` asks to end,
// if there is one: then it throws StoppedError. Throws UnreadableFileError.
std::string ReadText(const std::filesystem::path& path, const StopRequest* stop);

// The bytes of a photo that a database names: `name` starts from the directory of the photos and
// may not lead out of it, and the file must be a regular one of 1 to 2^30 bytes. Throws
// UnreadableFileError.
std::vector<unsigned char> ReadPhoto(const std::filesystem::path& directory,
                                     const std::string& name);

// Whether there is a regular file that begins as SQLite's do, or as photos do (JPEG, PNG, TIFF,
// WebP).
bool IsSqliteFile(const std::filesystem::path& path);
bool IsPhotoFile(const std::filesystem::path& path);

}  // namespace colmap_graphmatch
