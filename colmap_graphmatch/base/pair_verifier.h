#pragma once

#include <functional>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/base/verified_pair.h"

namespace colmap_graphmatch {

// The geometric verification of image pairs, as the sample-and-propagate loop sees it
// (GraphMatch, section 3: "passed to a feature matcher for geometric verification").
class PairVerifier {
 public:
  virtual ~PairVerifier() = default;

  // The pairs that were tested before this run, ascending. Verify answers them without testing them
  // again. Stays the same during a run.
  virtual const std::vector<VerifiedPair>& KnownPairs() const = 0;

  // Tests the pairs, which are all different from each other, and calls on_verified once for each,
  // on the calling thread, in any order. The outcomes should not depend on the number of threads or
  // on earlier calls. Returns false if it was asked to stop and left pairs out; those it reported
  // stay valid. Throws ColmapError or DatabaseError if it cannot go on; what it reported before
  // that stays valid too.
  virtual bool Verify(const std::vector<ImagePair>& pairs,
                      const std::function<void(const VerifiedPair&)>& on_verified) = 0;

  // The inlier matches of a known pair, or of the one that on_verified is being told of. Empty for
  // pairs without any, and if the verifier does not know them (a replay of a list of edges). Valid
  // until the next call of a member. Throws DatabaseError.
  virtual const FeatureMatches& Inliers(const ImagePair& pair) = 0;
};

}  // namespace colmap_graphmatch
