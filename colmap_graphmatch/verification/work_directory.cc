#include "colmap_graphmatch/verification/work_directory.h"

#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): mkdtemp is POSIX, not in <cstdlib>.

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

WorkDirectory::WorkDirectory(const std::filesystem::path& parent) {
  const char* variable = std::getenv("TMPDIR");
  const std::filesystem::path base = !parent.empty()       ? parent
                                     : variable != nullptr ? std::filesystem::path(variable)
                                                           : "/tmp";
  std::string name = (base / "graphmatch-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) {
    throw FileError(
        "Cannot make a working directory in " + base.string() + ": " + std::strerror(errno) +
        ". Name a directory on a disk with free space with --GraphMatching.work_path or "
        "in the environment variable TMPDIR.");
  }
  path_ = name;
}

WorkDirectory::~WorkDirectory() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace colmap_graphmatch
