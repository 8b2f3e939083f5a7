#pragma once

#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/exploration.h"
#include "colmap_graphmatch/graph/pair_proposer.h"

namespace colmap_graphmatch {

// Which of the pairs that the verifier knows become part of the graph unasked.
struct KnownPairsPolicy {
  std::vector<ImagePair> seeds;  // From the start; ascending.
  // The others, once the proposer has nothing more to propose: what is known may lead on.
  bool others_join_in_the_end = true;
};

// The one loop: has tested what the proposer proposes until it proposes nothing more. image_ids:
// the image of every vertex, ascending. on_progress may be empty. Exceptions of the verifier pass
// through.
ExplorationResult Explore(PairProposer& proposer, const std::vector<ImageId>& image_ids,
                          PairVerifier& verifier, const OnProgress& on_progress,
                          const KnownPairsPolicy& known = {});

}  // namespace colmap_graphmatch
