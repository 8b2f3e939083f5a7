#include "colmap_graphmatch/verification/work_directory.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <system_error>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random_name.h"

namespace colmap_graphmatch {
namespace {

// Less free space than this explains any failure of COLMAP.
constexpr std::uintmax_t kMinFreeBytes = std::uintmax_t{16} << 20;

// What the guard does, with standard input as its end of the socket. Between fork and exec of a
// process with threads only calls that are safe in signal handlers are allowed.
[[noreturn]] void WatchAndRemove(const char* path) {
  // Of another session, so that what ends this process on its terminal does not end it.
  ::setsid();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::signal(signal, SIG_IGN);
  const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  if (null >= 0) {
    ::dup2(null, STDOUT_FILENO);
    ::dup2(null, STDERR_FILENO);
  }
  // Where old kernels and containers do not have it, what they have open stays open.
  ::close_range(3, ~0U, 0);
  char byte = 0;
  ssize_t result = 0;
  do {
    result = ::read(STDIN_FILENO, &byte, 1);
  } while (result < 0 && errno == EINTR);
  if (result != 0) ::_exit(0);
  // The COLMAP processes die at the same moment; let them.
  const struct timespec pause = {0, 200'000'000};
  ::nanosleep(&pause, nullptr);
  ::execl("/bin/rm", "rm", "-rf", "--", path, static_cast<char*>(nullptr));
  ::_exit(1);
}

}  // namespace

WorkDirectory::WorkDirectory(const std::filesystem::path& parent, Guard guard) {
  const char* variable = std::getenv("TMPDIR");
  const bool is_set = variable != nullptr && *variable != '\0';
  const std::filesystem::path base = !parent.empty() ? parent
                                     : is_set        ? std::filesystem::path(variable)
                                                     : "/tmp";
  path_ = std::filesystem::absolute(base) / ("graphmatch-" + RandomName());
  // First, so that there is no moment at which the directory is there and the guard is not.
  if (guard == Guard::kGuarded) StartGuard();
  if (::mkdir(path_.c_str(), S_IRWXU) != 0) {
    const int error = errno;
    DismissGuard();
    throw FileError(
        "Cannot make a working directory in " + base.string() + ": " + std::strerror(error) +
        ". Name a directory on a disk with free space with --GraphMatching.work_path or "
        "in the environment variable TMPDIR.");
  }
}

void WorkDirectory::StartGuard() {
  std::array<int, 2> ends = {-1, -1};
  // Without a guard the directory is only left behind by kill -9.
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return;
  guard_ = ::fork();
  if (guard_ == 0) {
    ::close(ends[1]);
    ::dup2(ends[0], STDIN_FILENO);
    WatchAndRemove(path_.c_str());
  }
  ::close(ends[0]);
  guard_socket_ = ends[1];
}

WorkDirectory::~WorkDirectory() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
  if (error) RemoveByAnotherProcess();
  DismissGuard();
}

// For want of file descriptors, which that process has.
void WorkDirectory::RemoveByAnotherProcess() {
  if (guard_socket_ >= 0) {
    ::close(std::exchange(guard_socket_, -1));
    ::waitpid(guard_, nullptr, 0);
    return;
  }
  const pid_t remover = ::fork();
  if (remover == 0) {
    ::execl("/bin/rm", "rm", "-rf", "--", path_.c_str(), static_cast<char*>(nullptr));
    ::_exit(1);
  }
  if (remover > 0) ::waitpid(remover, nullptr, 0);
}

void WorkDirectory::DismissGuard() {
  if (guard_socket_ < 0) return;
  const char done = '.';
  ::send(guard_socket_, &done, 1, MSG_NOSIGNAL);
  ::close(guard_socket_);
  guard_socket_ = -1;
  if (guard_ > 0) ::waitpid(guard_, nullptr, 0);
}

void ThrowIfUnusable(const std::filesystem::path& work_path) {
  std::error_code error;
  if (!std::filesystem::is_directory(work_path, error)) {
    throw FileError("The working directory " + work_path.string() +
                    " is gone: another program, perhaps one that cleans up, has removed it during "
                    "the run. Name another directory with --GraphMatching.work_path, and run the "
                    "same command again to go on.");
  }
  const std::filesystem::path probe = work_path / "probe";
  const int number = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (number < 0 && errno != EMFILE && errno != ENFILE && errno != ENOSPC) {
    throw FileError("Cannot write to the working directory " + work_path.string() + ": " +
                    std::strerror(errno) +
                    ". Name another one with --GraphMatching.work_path; run the same command again "
                    "to go on.");
  }
  if (number >= 0) ::close(number);
  std::filesystem::remove(probe, error);
  const std::filesystem::space_info space = std::filesystem::space(work_path, error);
  if (error || space.available >= kMinFreeBytes) return;
  throw FileError("The disk of the working directory " + work_path.string() +
                  " is full: less than 16 MB are free. Free some space or name another directory "
                  "with --GraphMatching.work_path; run the same command again to go on.");
}

}  // namespace colmap_graphmatch
