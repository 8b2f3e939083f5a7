// What fuzzing found in command lines and project files (tests/fuzz/fuzz_options.cc).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/cli/options.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::HasSubstr;

std::string MessageOf(const std::vector<const char*>& arguments) {
  try {
    ParseCommandLine(static_cast<int>(arguments.size()), arguments.data());
  } catch (const OptionsError& error) {
    return error.what();
  }
  return "";
}

// Boost looks for these marks in its message after it has put the user's words into it.
TEST(HostileOptions, MarksOfBoostsMessages) {
  const TestDirectory directory;
  const std::filesystem::path project = directory.Path() / "project.ini";
  for (const std::string mark :
       {"%value%", "argument ('%value%')", "%option%", "%canonical_option%", "%prefix%",
        "option '%canonical_option%'", "%invalid_line%", "%%value%%", "100%"}) {
    EXPECT_THAT(MessageOf({"graphmatch_matcher", "--random_seed", mark.c_str()}),
                HasSubstr("random_seed"));
    EXPECT_THAT(MessageOf({"graphmatch_matcher", ("--" + mark).c_str()}), HasSubstr("%"));
    for (const std::string& line : {"random_seed=" + mark, mark, "[" + mark, mark + "=1"}) {
      std::ofstream(project) << line << '\n';
      EXPECT_NE(MessageOf({"graphmatch_matcher", "--project_path", project.c_str()}), "") << line;
    }
  }
}

}  // namespace
}  // namespace colmap_graphmatch
