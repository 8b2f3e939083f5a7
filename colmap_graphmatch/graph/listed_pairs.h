#pragma once

#include <functional>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/graphmatch.h"

namespace colmap_graphmatch {

// Has pairs tested that are given beforehand instead of found by sampling and propagation: all
// pairs of the images, block of images by block of images, or those of a list. Known pairs are
// asked for like all others, in the same batches, so that a run that goes on after an interruption
// ends like one that was not interrupted; those that were not asked for are added to the graph in
// the end. image_ids: ascending; pairs of other images, pairs of an image with itself,
// repeated pairs and those that the restrictions do not allow are left out. Memory grows with the
// number of tested pairs. Exceptions of the verifier pass through.
GraphMatchResult VerifyAllPairs(const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                                const std::function<void(const LoopProgress&)>& on_progress,
                                const PairRestrictions& restrictions = {});
GraphMatchResult VerifyListedPairs(const std::vector<ImagePair>& pairs,
                                   const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                                   const std::function<void(const LoopProgress&)>& on_progress,
                                   const PairRestrictions& restrictions = {});

}  // namespace colmap_graphmatch
