#pragma once

#include <filesystem>
#include <string>

#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"

namespace colmap_graphmatch {

// What a run found and what it cost, for other programs: a JSON object, the members of which
// docs/formats.md describes.
std::string MakeJsonReport(const PipelineOptions& options, const PipelineResult& result);

// Throws FileError if the file cannot be written; then what was there before is still there.
void WriteJsonReport(const std::filesystem::path& path, const PipelineOptions& options,
                     const PipelineResult& result);

}  // namespace colmap_graphmatch
