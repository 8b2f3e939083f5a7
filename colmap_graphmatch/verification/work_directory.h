#pragma once

#include <filesystem>

namespace colmap_graphmatch {

// A private directory (mode 0700) for the files of one run, removed with all its contents at the
// end.
class WorkDirectory {
 public:
  // parent: where to make it; empty: $TMPDIR, or /tmp. Throws FileError.
  explicit WorkDirectory(const std::filesystem::path& parent);
  ~WorkDirectory();
  WorkDirectory(const WorkDirectory&) = delete;
  WorkDirectory& operator=(const WorkDirectory&) = delete;

  const std::filesystem::path& Path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace colmap_graphmatch
