#include "colmap_graphmatch/verification/subprocess.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/process.hpp>
#include <boost/process/extend.hpp>
#include <chrono>
#include <csignal>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

namespace bp = boost::process;

// Between two looks at the program. Short against the start-up of COLMAP (25 ms).
constexpr std::chrono::milliseconds kPollInterval(4);

std::string Rounded(double seconds) {
  std::string text = std::to_string(seconds);
  text.resize(text.find('.') + 2);
  return text;
}

}  // namespace

std::string SubprocessResult::Describe() const {
  switch (ending) {
    case Ending::kSignal:
      return "was killed by signal " + std::to_string(signal) + " (" + ::strsignal(signal) + ")";
    case Ending::kTimedOut:
      return "did not finish within " + Rounded(seconds) + " s and was killed";
    case Ending::kStopped:
      return "was stopped";
    case Ending::kExited:
      break;
  }
  return "ended with exit code " + std::to_string(exit_code);
}

SubprocessResult RunSubprocess(const std::vector<std::string>& command,
                               const std::filesystem::path& output_path, double timeout_seconds,
                               const std::function<bool()>& should_stop) {
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  // Until exec, a child holds what others have just opened and not yet marked to be closed: one at
  // a time.
  static std::mutex starting;
  std::unique_lock<std::mutex> lock(starting);
  const pid_t parent = ::getpid();
  bp::group group;
  std::error_code error;
  // Boost opens it for writing without cutting off what it contains.
  std::error_code ignored;
  std::filesystem::remove(output_path, ignored);
  bp::child child(
      bp::exe = command.front(),
      bp::args = std::vector<std::string>(command.begin() + 1, command.end()),
      bp::std_in<bp::null, (bp::std_out & bp::std_err)> output_path.string(), group, error,
      bp::extend::on_exec_setup = [parent](auto&) {
        ::signal(SIGPIPE, SIG_DFL);
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (::getppid() != parent) ::_exit(1);
      });
  lock.unlock();
  if (error) {
    throw ColmapError("Cannot start " + command.front() + ": " + error.message() +
                      ". If it is not a program that runs on this machine, name another with "
                      "--colmap_path.");
  }

  SubprocessResult result;
  bool killed = false;
  while (child.running(error)) {
    if (should_stop()) {
      result.ending = SubprocessResult::Ending::kStopped;
      killed = true;
    } else if (timeout_seconds > 0 && elapsed() > timeout_seconds) {
      result.ending = SubprocessResult::Ending::kTimedOut;
      killed = true;
    }
    if (killed) {
      group.terminate(error);
      child.wait(error);
      break;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  result.seconds = elapsed();
  if (killed) return result;

  const int status = child.native_exit_code();
  if (WIFSIGNALED(status)) {
    result.ending = SubprocessResult::Ending::kSignal;
    result.signal = WTERMSIG(status);
  } else {
    result.exit_code = WEXITSTATUS(status);
  }
  return result;
}

}  // namespace colmap_graphmatch
