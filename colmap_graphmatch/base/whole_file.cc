#include "colmap_graphmatch/base/whole_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

namespace {

std::filesystem::path Partial(const std::filesystem::path& path) {
  return path.string() + ".partial";
}

[[noreturn]] void Fail(const std::filesystem::path& path, const std::string& reason) {
  std::error_code ignored;
  std::filesystem::remove(Partial(path), ignored);
  throw FileError("Cannot write " + path.string() + ": " + reason + ".");
}

}  // namespace

void WriteWholeFile(const std::filesystem::path& path,
                    const std::function<void(std::ostream&)>& write) {
  std::ofstream file(Partial(path), std::ios::binary | std::ios::trunc);
  if (!file) Fail(path, std::strerror(errno));
  write(file);
  file.close();
  if (!file) Fail(path, std::strerror(errno));
  std::error_code error;
  std::filesystem::rename(Partial(path), path, error);
  if (error) Fail(path, error.message());
}

void CheckCanWrite(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) Fail(path, std::strerror(EISDIR));
  if (!std::ofstream(Partial(path))) Fail(path, std::strerror(errno));
  std::filesystem::remove(Partial(path), ignored);
}

}  // namespace colmap_graphmatch
