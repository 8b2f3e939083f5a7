#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"

namespace colmap_graphmatch {

struct CommandLine {
  PipelineOptions pipeline;
  bool help = false;
  bool version = false;
  // Options of vocab_tree_matcher that were given and have no meaning here.
  std::vector<std::string> unused_options;
};

// Throws OptionsError.
CommandLine ParseCommandLine(int argc, const char* const* argv);

void PrintHelp(std::ostream& stream);

}  // namespace colmap_graphmatch
