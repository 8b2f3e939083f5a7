#include "colmap_graphmatch/base/random_name.h"

#include <sys/random.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

std::string RandomName() {
  static constexpr char kDigits[] = "0123456789abcdefghijklmnopqrstuv";
  std::array<unsigned char, 16> bytes = {};
  // The kernel's: it needs no file of /dev, which a container may lack.
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw FileError(std::string("The system gives no random numbers: ") + std::strerror(errno) +
                    ".");
  }
  std::string name;
  for (const unsigned char byte : bytes) name += kDigits[byte % 32];
  return name;
}

}  // namespace colmap_graphmatch
