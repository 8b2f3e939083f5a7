#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"

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
// When this process dies, the program is killed too. What it keeps in temporary files (glog's logs,
// when it aborts) goes to the directory of output_path. Waits for it; kills its whole group after
// timeout_seconds (no limit if it is not positive) or once should_stop returns true.
//
// Throws ColmapError if it cannot be started; FileError if output_path cannot be written;
// SystemLimitError if for some seconds the system allows no more processes, or at once if it allows
// no more open files.
SubprocessResult RunSubprocess(const std::vector<std::string>& command,
                               const std::filesystem::path& output_path, double timeout_seconds,
                               const std::function<bool()>& should_stop);

// The same, for a short program that changes nothing: tried again if a signal killed it, which then
// was not its fault. Throws StoppedError too, if `stop` ended it.
SubprocessResult RunTwice(const std::vector<std::string>& command,
                          const std::filesystem::path& output_path, double timeout_seconds,
                          const StopRequest& stop);

}  // namespace colmap_graphmatch
