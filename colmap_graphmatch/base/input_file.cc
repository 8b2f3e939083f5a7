#include "colmap_graphmatch/base/input_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "colmap_graphmatch/base/file_descriptor.h"

namespace colmap_graphmatch {
namespace {

constexpr off_t kMaxPhotoBytes = off_t{1} << 30;

std::string DescribeKind(mode_t mode) {
  if (S_ISDIR(mode)) return std::strerror(EISDIR);
  if (S_ISFIFO(mode)) return "it is a pipe, not a regular file";
  if (S_ISSOCK(mode)) return "it is a socket, not a regular file";
  return "it is a device, not a regular file";
}

bool StaysBelow(const std::filesystem::path& name) {
  return !name.empty() && name.is_relative() && *name.lexically_normal().begin() != "..";
}

// Reads a pipe to its end. It was opened without waiting for a writer.
std::string ReadPipe(const std::filesystem::path& path, int number, const StopRequest* stop) {
  constexpr int kMilliseconds = 100;
  std::string text;
  std::array<char, 65536> bytes = {};
  while (true) {
    if (stop != nullptr) stop->ThrowIfRequested();
    pollfd waiting = {number, POLLIN, 0};
    // Says that the writer is gone only if there has been one.
    if (::poll(&waiting, 1, kMilliseconds) <= 0) continue;
    const ssize_t size = ::read(number, bytes.data(), bytes.size());
    if (size == 0) return text;
    if (size > 0) {
      text.append(bytes.data(), static_cast<std::size_t>(size));
    } else if (errno != EAGAIN && errno != EINTR) {
      throw UnreadableFileError(path, std::strerror(errno));
    }
  }
}

struct OpenedFile {
  FileDescriptor descriptor;
  struct stat status = {};
};

// Without waiting, whatever it is. Not for devices, sockets and directories.
OpenedFile Open(const std::filesystem::path& path) {
  OpenedFile file = {
      FileDescriptor(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY))};
  if (file.descriptor.Number() < 0 || ::fstat(file.descriptor.Number(), &file.status) != 0) {
    throw UnreadableFileError(path, std::strerror(errno));
  }
  const mode_t mode = file.status.st_mode;
  if (!S_ISREG(mode) && !S_ISFIFO(mode)) throw UnreadableFileError(path, DescribeKind(mode));
  return file;
}

// All of a regular file.
template <typename Bytes>
Bytes ReadAll(const std::filesystem::path& path, const OpenedFile& file) {
  if (!S_ISREG(file.status.st_mode)) {
    throw UnreadableFileError(path, DescribeKind(file.status.st_mode));
  }
  // With room for the end to be found.
  Bytes bytes(static_cast<std::size_t>(file.status.st_size) + 1, 0);
  std::size_t num_read = 0;
  while (true) {
    if (num_read == bytes.size()) bytes.resize(num_read + 4096);  // It may be growing.
    const ssize_t size =
        ::read(file.descriptor.Number(), bytes.data() + num_read, bytes.size() - num_read);
    if (size == 0) break;
    if (size < 0 && errno != EINTR) throw UnreadableFileError(path, std::strerror(errno));
    if (size > 0) num_read += static_cast<std::size_t>(size);
  }
  bytes.resize(num_read);
  return bytes;
}

// The first 16 bytes; fewer, or none, if there is no such regular file.
std::string Beginning(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return "";
  std::string bytes(16, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

}  // namespace

std::string WhyNotRegular(const std::filesystem::path& path) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) return errno == ENOENT ? "" : std::strerror(errno);
  return S_ISREG(status.st_mode) ? "" : DescribeKind(status.st_mode);
}

std::ifstream OpenRegularFile(const std::filesystem::path& path) {
  const std::string reason = WhyNotRegular(path);
  if (!reason.empty()) throw UnreadableFileError(path, reason);
  std::ifstream file(path, std::ios::binary);
  if (!file) throw UnreadableFileError(path, std::strerror(errno));
  return file;
}

std::string ReadText(const std::filesystem::path& path, const StopRequest* stop) {
  const OpenedFile file = Open(path);
  if (S_ISFIFO(file.status.st_mode)) return ReadPipe(path, file.descriptor.Number(), stop);
  return ReadAll<std::string>(path, file);
}

std::vector<unsigned char> ReadPhoto(const std::filesystem::path& directory,
                                     const std::string& name) {
  const std::filesystem::path relative = std::filesystem::u8path(name);
  if (!StaysBelow(relative)) {
    throw UnreadableFileError(name, "the name leads out of the directory of the photos");
  }
  const std::filesystem::path path = directory / relative;
  const OpenedFile file = Open(path);
  if (file.status.st_size == 0) throw UnreadableFileError(path, "it is empty");
  if (file.status.st_size > kMaxPhotoBytes) {
    throw UnreadableFileError(path, "it has more than 1 GiB, which no photo has");
  }
  return ReadAll<std::vector<unsigned char>>(path, file);
}

bool IsSqliteFile(const std::filesystem::path& path) {
  return Beginning(path) == std::string_view("SQLite format 3\0", 16);
}

bool IsPhotoFile(const std::filesystem::path& path) {
  const std::string beginning = Beginning(path);
  const auto begins = [&beginning](std::string_view with, std::size_t at = 0) {
    return beginning.size() >= at + with.size() &&
           std::string_view(beginning).substr(at, with.size()) == with;
  };
  return begins("\xFF\xD8\xFF") || begins("\x89PNG") || begins(std::string_view("II*\0", 4)) ||
         begins(std::string_view("MM\0*", 4)) || (begins("RIFF") && begins("WEBP", 8));
}

}  // namespace colmap_graphmatch
