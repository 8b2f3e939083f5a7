#pragma once

#include <filesystem>
#include <system_error>

#include "colmap_graphmatch/base/enum_words.h"

namespace colmap_graphmatch {

// What is logged, and where. Errors that end the program reach the standard error output always.
struct LogOptions {
  enum class Target { kStderr, kStdout, kFile, kStderrAndFile };

  Target target = Target::kStderrAndFile;
  std::filesystem::path path;  // A file, appended to, or a directory; empty: no file.
  int severity = 0;            // The least one that is logged: 0 info, 1 warnings, 2 and 3 errors.
  int verbosity = 0;           // From 3 on every stage of every iteration has a line.
  bool color = true;           // On a terminal, unless NO_COLOR is set.
  bool quiet = false;          // No progress, and no severity below warnings.

  // The file that is appended to; empty: none.
  std::filesystem::path FilePath() const {
    const bool has_file = target == Target::kFile || target == Target::kStderrAndFile;
    if (!has_file || path.empty()) return {};
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored) ? path / "graphmatch_matcher.log" : path;
  }
};

inline constexpr EnumWords<LogOptions::Target, 4> kLogTargetWords = {
    {{LogOptions::Target::kStderr, "stderr"},
     {LogOptions::Target::kStdout, "stdout"},
     {LogOptions::Target::kFile, "file"},
     {LogOptions::Target::kStderrAndFile, "stderr_and_file"}}};

}  // namespace colmap_graphmatch
