#include "colmap_graphmatch/base/input_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "colmap_graphmatch/base/file_descriptor.h"

namespace colmap_graphmatch {
namespace {

constexpr std::uintmax_t kMaxPhotoBytes = std::uintmax_t{1} << 30;

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
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  const int number = file.Number();
  if (number < 0) throw UnreadableFileError(path, std::strerror(errno));
  struct stat status = {};
  if (::fstat(number, &status) != 0) throw UnreadableFileError(path, std::strerror(errno));
  if (S_ISFIFO(status.st_mode)) return ReadPipe(path, number, stop);
  if (!S_ISREG(status.st_mode)) throw UnreadableFileError(path, DescribeKind(status.st_mode));
  std::string text(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t num_read = 0;
  while (true) {
    if (num_read == text.size()) text.resize(num_read + 4096);  // It may be growing.
    const ssize_t size = ::read(number, text.data() + num_read, text.size() - num_read);
    if (size == 0) break;
    if (size < 0 && errno != EINTR) throw UnreadableFileError(path, std::strerror(errno));
    if (size > 0) num_read += static_cast<std::size_t>(size);
  }
  text.resize(num_read);
  return text;
}

std::vector<unsigned char> ReadPhoto(const std::filesystem::path& directory,
                                     const std::string& name) {
  const std::filesystem::path relative = std::filesystem::u8path(name);
  const std::filesystem::path path = directory / relative;
  if (!StaysBelow(relative)) {
    throw UnreadableFileError(name, "the name leads out of the directory of the photos");
  }
  std::ifstream file = OpenRegularFile(path);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw UnreadableFileError(path, error.message());
  if (size == 0) throw UnreadableFileError(path, "it is empty");
  if (size > kMaxPhotoBytes) {
    throw UnreadableFileError(path, "it has more than 1 GiB, which no photo has");
  }
  std::vector<unsigned char> bytes(size);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!file) throw UnreadableFileError(path, "it ends early");
  return bytes;
}

bool IsSqliteFile(const std::filesystem::path& path) {
  constexpr std::array<char, 16> kMagic = {'S', 'Q', 'L', 'i', 't', 'e', ' ', 'f',
                                           'o', 'r', 'm', 'a', 't', ' ', '3', '\0'};
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;
  std::array<char, kMagic.size()> begin = {};
  std::ifstream file(path, std::ios::binary);
  return file.read(begin.data(), begin.size()) && begin == kMagic;
}

}  // namespace colmap_graphmatch
