#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <ostream>

namespace colmap_graphmatch {

class DescriptorBuffer;

// Files that a user asked for: reports, exports, logs.
//
// A regular file is replaced as a whole, where links to it lead; one that is none (a pipe, a
// device, /dev/stdout) is written to. A SQLite database, what SQLite keeps beside one, and a photo
// are never replaced or written to. All functions throw FileError.

// Writes a file under a name that nobody else has, in the same directory, and then gives it its
// own: at no time is there a half-written one, not even after a loss of power.
void WriteWholeFile(const std::filesystem::path& path,
                    const std::function<void(std::ostream&)>& write);

// Whether that is what WriteWholeFile would do; else it would write to what there is.
bool IsReplacedAsAWhole(const std::filesystem::path& path);

// Whether that can be expected to go well, before something is computed for long. Leaves what is
// there.
void CheckCanWrite(const std::filesystem::path& path);

// A file that grows while the program works.
class GrowingFile : public std::ostream {
 public:
  // kAnew: a regular file is emptied first.
  enum class Mode { kAnew, kAppend };
  GrowingFile(const std::filesystem::path& path, Mode mode);
  ~GrowingFile() override;
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  // The errno of what could not be written since it was opened; 0: none. What is still to be
  // written is not counted: flush first.
  int Error() const;

 private:
  std::unique_ptr<DescriptorBuffer> buffer_;
};

}  // namespace colmap_graphmatch
