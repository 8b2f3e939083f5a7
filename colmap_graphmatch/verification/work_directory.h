#pragma once

#include <sys/types.h>

#include <filesystem>

namespace colmap_graphmatch {

// A private directory (mode 0700), removed with all its contents at the end.
class WorkDirectory {
 public:
  // kGuarded: a process of its own waits for the end of this one and removes the directory even
  // after kill -9.
  enum class Guard { kUnguarded, kGuarded };

  // parent: where to make it; empty: $TMPDIR, or /tmp if that is not set or empty. Throws
  // FileError.
  explicit WorkDirectory(const std::filesystem::path& parent, Guard guard = Guard::kUnguarded);
  ~WorkDirectory();
  WorkDirectory(const WorkDirectory&) = delete;
  WorkDirectory& operator=(const WorkDirectory&) = delete;

  const std::filesystem::path& Path() const { return path_; }

 private:
  void StartGuard();
  void DismissGuard();
  void RemoveByAnotherProcess();

  std::filesystem::path path_;
  int guard_socket_ = -1;  // The guard acts when this end is closed without a word.
  pid_t guard_ = -1;
};

// Throws FileError if a working directory is gone or cannot be written to, or if its disk is full,
// or all but full: whatever has failed in it, or seems to have succeeded, cannot be trusted then.
void ThrowIfUnusable(const std::filesystem::path& work_path);

}  // namespace colmap_graphmatch
