#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {

// A file that a run reads or writes.
struct RunFile {
  enum class Use {
    kRead,
    kKept,     // Part of the database or of the state file: read and written, never made anew.
    kWritten,  // Made anew as a whole.
    kGrows,    // A log.
  };
  std::string option;  // What names it, in messages.
  std::filesystem::path path;
  Use use = Use::kRead;
  // Of a file that comes beside another: that one. Its name was not chosen by the user.
  std::filesystem::path beside = {};
};

// All files that the run may touch, those that it has beside others included; but for COLMAP, the
// photos below --image_path, which are only read, and the working directory, which is its own
// (docs/formats.md).
std::vector<RunFile> FilesOfRun(const CommandLine& line);

// Throws OptionsError if a file that is written, or grows, is one that is read or kept, or another
// one that is written: one would take the place of the other. Devices and pipes may be written to
// by several.
void CheckThatFilesDiffer(const std::vector<RunFile>& files);

// Checks before the work begins that what is to be made anew can be, and that no file of the user's
// is in the place of one whose name he did not choose. Throws FileError.
void CheckOutputs(const std::vector<RunFile>& files);

}  // namespace colmap_graphmatch
