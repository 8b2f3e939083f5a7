// libFuzzer: the first byte of the input says what the rest is, a project file or a list of pairs.
// Errors of base/errors.h are fine.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/cli/options.h"
#include "colmap_graphmatch/files/pair_list.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

class Fuzzer {
 public:
  void Run(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return;
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(data + 1), static_cast<std::streamsize>(size - 1));
    try {
      if (data[0] % 2 == 0) {
        const std::array<const char*, 5> arguments = {"graphmatch_matcher", "--project_path",
                                                      path_.c_str(), "--database_path", "a.db"};
        // With and without an option on the command line that the project may give, too.
        const CommandLine line = ParseCommandLine(data[0] % 4 == 0 ? 5 : 3, arguments.data());
        line.pipeline.Check();
      } else {
        ReadPairList(path_, images_);
      }
    } catch (const Error&) {
    }
  }

 private:
  TestDirectory directory_;
  std::filesystem::path path_ = directory_.Path() / "input";
  std::vector<ImageRecord> images_ = {
      {1, "a.jpg", 1}, {2, "b.jpg", 1}, {3, "a b.jpg", 1}, {4, "c", 1}, {5, "c c", 1},
      {6, "", 1},      {7, "c\tc", 1},  {8, "c", 1},       {9, "d", 0}, {10, "x\ny.jpg", 1}};
};

}  // namespace
}  // namespace colmap_graphmatch

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static colmap_graphmatch::Fuzzer fuzzer;
  fuzzer.Run(data, size);
  return 0;
}
