#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/pair_proposer.h"

namespace colmap_graphmatch {

// Finds out which known pairs have to be part of the graph from the start, so that what earlier
// runs did is gone on with (docs/design.md); ascending. Known pairs that are no seeds are answered
// from what is known in the places where an undisturbed run would have tested them; so a run that
// goes on after an interruption follows the path of the first and tests what is missing. If a
// proposer that make_proposer makes, started from the earlier seeds (those of the run that may have
// been interrupted; ascending) or from none, asks for everything that is known, these are the
// seeds. Otherwise another matcher tested pairs, or images were added, and all known pairs are.
// Throws StoppedError if stop asks for it.
std::vector<ImagePair> ChooseSeeds(
    const std::function<std::unique_ptr<PairProposer>()>& make_proposer,
    const std::vector<ImageId>& image_ids, PairVerifier& verifier,
    const std::vector<ImagePair>& earlier_seeds, const StopRequest& stop);

}  // namespace colmap_graphmatch
