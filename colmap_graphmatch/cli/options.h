#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/cli/log_options.h"
#include "colmap_graphmatch/pipeline/options.h"

namespace colmap_graphmatch {

struct CommandLine {
  PipelineOptions pipeline;
  bool dry_run = false;  // Only the candidates are wanted.
  bool help = false;
  bool help_all = false;
  bool version = false;
  std::filesystem::path project_path;
  std::filesystem::path report_path;
  std::filesystem::path pair_list_path;
  std::filesystem::path graph_path;
  LogOptions log;
  bool log_to_stderr = true;
  bool seed_from_clock = false;
  bool lightglue = false;  // The matcher's type is SIFT_LIGHTGLUE.
  // What is to be said about options of vocab_tree_matcher that were given and have no meaning
  // here, an entry each.
  std::vector<std::string> unused_options;
  std::vector<std::string> warnings;
};

// stop: ends the wait for a project file that comes from a pipe (base/input_file.h). Throws
// OptionsError and StoppedError.
CommandLine ParseCommandLine(int argc, const char* const* argv, const StopRequest* stop = nullptr);

// For -h and --help: one screen with an example and the options that are used most.
void PrintHelp(std::ostream& stream);

// For --help-all: every option that has an effect.
void PrintFullHelp(std::ostream& stream);

}  // namespace colmap_graphmatch
