#pragma once

#include <string>

#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"

namespace colmap_graphmatch {

// What the run found and what it cost.
std::string FormatSummary(const PipelineOptions& options, const PipelineResult& result);

}  // namespace colmap_graphmatch
