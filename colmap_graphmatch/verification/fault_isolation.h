#pragma once

#include <vector>

#include "colmap_graphmatch/verification/geometry_verifier.h"
#include "colmap_graphmatch/verification/shard_runner.h"

namespace colmap_graphmatch {

// Has the pairs verified as one shard. If that fails, tries again, which gets past what was not
// their fault (memory, a signal); then halves them until the pair that is to blame is alone: that
// one is a failure, and all others have results. Hands everything to `progress` as it is finished,
// and stops when that gives up.
void VerifyAndIsolate(GeometryVerifier& verifier, const std::vector<PairToVerify>& pairs,
                      ShardRunner::Progress& progress);

}  // namespace colmap_graphmatch
