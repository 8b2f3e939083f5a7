#include "colmap_graphmatch/verification/subprocess.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

// Boost.Process has its vfork only where this is said.
#define BOOST_POSIX_HAS_VFORK 1
#include <boost/process.hpp>
#include <boost/process/extend.hpp>
#include <boost/process/posix.hpp>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/file_descriptor.h"
#include "colmap_graphmatch/base/stopwatch.h"

namespace colmap_graphmatch {
namespace {

namespace bp = boost::process;

// Between two looks at the program. Short against the start-up of COLMAP (25 ms).
constexpr std::chrono::milliseconds kPollInterval(4);

// How long a process is waited for that the system does not allow, and how long between two tries.
constexpr double kSecondsForProcess = 3;
constexpr std::chrono::milliseconds kRetryInterval(50);

bool IsLimit(const std::error_code& error) {
  return error == std::errc::resource_unavailable_try_again ||
         error == std::errc::not_enough_memory || error == std::errc::too_many_files_open ||
         error == std::errc::too_many_files_open_in_system;
}

// Boost.Process does not say which file it could not open.
void CheckCanStart(const std::filesystem::path& output_path) {
  // Written anew: Boost does not cut off what a file contains.
  std::error_code ignored;
  std::filesystem::remove(output_path, ignored);
  std::vector<FileDescriptor> files;
  const auto open = [&files](const std::filesystem::path& path, int flags,
                             const std::string& advice) {
    files.emplace_back(::open(path.c_str(), flags | O_CLOEXEC, 0600));
    const int error = errno;
    if (files.back().Number() >= 0) return;
    if (error == EMFILE || error == ENFILE) {
      throw SystemLimitError(std::string("Cannot start COLMAP: ") + std::strerror(error) +
                             ". Let the program open more files (ulimit -n), or use fewer threads "
                             "with --SiftMatching.num_threads.");
    }
    throw FileError("Cannot open " + path.string() + ": " + std::strerror(error) + ". " + advice);
  };
  open(output_path, O_WRONLY | O_CREAT,
       "It is in the working directory: name another one with --GraphMatching.work_path.");
  // As many as Boost has open at a time: a pipe of its own, and one for each stream.
  for (int i = 0; i < 4; ++i) {
    open("/dev/null", O_RDWR, "COLMAP needs it: mount /dev, also in a container or a chroot.");
  }
}

// No signal is handled in this thread while it is there.
class BlockedSignals {
 public:
  BlockedSignals() {
    ::sigfillset(&all_);
    ::pthread_sigmask(SIG_SETMASK, &all_, &before_);
  }
  ~BlockedSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  BlockedSignals(const BlockedSignals&) = delete;
  BlockedSignals& operator=(const BlockedSignals&) = delete;

  // In a child that shares our memory until exec: what handles signals here must not run there.
  void UnblockInChild() const {
    for (int signal = 1; signal < NSIG; ++signal) {
      struct sigaction action = {};
      if (::sigaction(signal, nullptr, &action) != 0) continue;
      if (action.sa_handler == SIG_IGN || action.sa_handler == SIG_DFL) continue;
      ::signal(signal, SIG_DFL);
    }
    // Sent to the whole group, and meant for us.
    const timespec at_once = {};
    while (::sigtimedwait(&all_, nullptr, &at_once) > 0) {
    }
    ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }

 private:
  sigset_t all_ = {};
  sigset_t before_ = {};
};

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
  bp::environment environment = boost::this_process::environment();
  const std::string directory = output_path.parent_path().string();
  environment["TMPDIR"] = directory;
  if (environment.count("GLOG_log_dir") == 0) environment["GLOG_log_dir"] = directory;
  Stopwatch elapsed;
  // Until exec, a child holds what others have just opened and not yet marked to be closed: one at
  // a time.
  static std::mutex starting;
  std::unique_lock<std::mutex> lock(starting);
  CheckCanStart(output_path);
  const pid_t parent = ::getpid();
  bp::group group;
  std::error_code error;
  const auto start = [&] {
    const BlockedSignals signals;
    return bp::child(
// Not fork: to copy the tables of our memory takes as long as the start of COLMAP. ThreadSanitizer
// makes a fork of it, and Boost would not learn then that a program cannot start.
#ifndef __SANITIZE_THREAD__
        bp::posix::use_vfork,
#endif
        bp::exe = command.front(),
        bp::args = std::vector<std::string>(command.begin() + 1, command.end()), environment,
        bp::std_in<bp::null, (bp::std_out & bp::std_err)> output_path.string(), group, error,
        bp::extend::on_exec_setup = [parent, &signals](auto&) {
          // What is ignored here would be ignored there.
          for (const int signal : {SIGPIPE, SIGXFSZ}) ::signal(signal, SIG_DFL);
          ::prctl(PR_SET_PDEATHSIG, SIGKILL);
          if (::getppid() != parent) ::_exit(1);
          signals.UnblockInChild();
        });
  };
  bp::child child = start();
  // Others may end.
  while (IsLimit(error) && elapsed.Seconds() < kSecondsForProcess && !should_stop()) {
    lock.unlock();
    std::this_thread::sleep_for(kRetryInterval);
    lock.lock();
    error.clear();
    group = bp::group();
    child = start();
  }
  lock.unlock();
  if (error && should_stop()) {
    SubprocessResult stopped;
    stopped.ending = SubprocessResult::Ending::kStopped;
    return stopped;
  }
  if (IsLimit(error)) {
    throw SystemLimitError("Cannot start " + command.front() + ": " + error.message() +
                           ". The system lets this user or container have no more processes and "
                           "threads, or open files: raise that limit (ulimit -u, ulimit -n, "
                           "Docker's --pids-limit), or use fewer with --SiftMatching.num_threads.");
  }
  elapsed = Stopwatch();
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
    } else if (timeout_seconds > 0 && elapsed.Seconds() > timeout_seconds) {
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
  result.seconds = elapsed.Seconds();
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

SubprocessResult RunTwice(const std::vector<std::string>& command,
                          const std::filesystem::path& output_path, double timeout_seconds,
                          const StopRequest& stop) {
  SubprocessResult result;
  for (int i = 0; i < 2; ++i) {
    result = RunSubprocess(command, output_path, timeout_seconds, [&] { return stop.Requested(); });
    stop.ThrowIfRequested();
    // A shell that runs it ends with 128 and the signal.
    const bool is_killed =
        result.ending == SubprocessResult::Ending::kSignal || result.exit_code > 128;
    if (!is_killed) break;
  }
  return result;
}

}  // namespace colmap_graphmatch
