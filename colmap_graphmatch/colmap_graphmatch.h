#pragma once

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/base/version.h"
#include "colmap_graphmatch/pipeline/observer.h"
#include "colmap_graphmatch/pipeline/options.h"
#include "colmap_graphmatch/pipeline/result.h"

// All that a program needs that uses this library; the headers that are installed are those that
// this one includes.
namespace colmap_graphmatch {

// The whole job: from the features in the database to its two-view geometries. Throws the errors of
// base/errors.h, StoppedError among them if stop was raised before the first pair; every shard that
// was verified until then is in the database.
PipelineResult RunPipeline(const PipelineOptions& options, const StopRequest& stop,
                           PipelineObserver& observer);

// Ranks the images and tests nothing: the pairs that the strategy would draw for each image if none
// of them matched, but for those tested already. COLMAP is not run, and nothing is written to the
// database; DATABASE.graphmatch keeps the vectors for the next run. pair_log_path, keep_details and
// budget have no effect. Throws the errors of base/errors.h; OptionsError for a strategy that does
// not rank images, and for a replay_path.
CandidateList FindCandidates(const PipelineOptions& options, const StopRequest& stop,
                             PipelineObserver& observer);

}  // namespace colmap_graphmatch
