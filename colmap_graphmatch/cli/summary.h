#pragma once

#include <string>

#include "colmap_graphmatch/pipeline/options.h"
#include "colmap_graphmatch/pipeline/result.h"

namespace colmap_graphmatch {

// What the run found and what it cost.
std::string FormatSummary(const PipelineOptions& options, const PipelineResult& result);

// What it would begin with.
std::string FormatSummary(const CandidateList& candidates);

}  // namespace colmap_graphmatch
