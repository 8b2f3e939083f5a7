#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace colmap_graphmatch {

struct SubprocessResult {
  enum class Ending {
    kExited,    // exit_code is valid.
    kSignal,    // Killed by signal `signal`.
    kTimedOut,  // Killed here, since it ran longer than it may.
    kStopped,   // Killed here, since should_stop said so.
  };
  Ending ending = Ending::kExited;
  int exit_code = 0;
  int signal = 0;
  double seconds = 0;

  bool Succeeded() const { return ending == Ending::kExited && exit_code == 0; }
  // "ended with exit code 1", "was killed by signal 6 (Aborted)", ...
  std::string Describe() const;
};

// Runs a program without a shell, with its standard output and standard error in one file and no
// standard input, in a process group of its own, so that Ctrl-C on the terminal does not reach it.
// When this process dies, the program is killed too. Waits for it; kills its whole group after
// timeout_seconds (no limit if it is not positive) or once should_stop returns true. Throws
// ColmapError if it cannot be started.
SubprocessResult RunSubprocess(const std::vector<std::string>& command,
                               const std::filesystem::path& output_path, double timeout_seconds,
                               const std::function<bool()>& should_stop);

}  // namespace colmap_graphmatch
