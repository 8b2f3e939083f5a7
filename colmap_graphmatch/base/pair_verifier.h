#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

enum class PairOutcome : std::uint8_t {
  kEdge,    // The pair passed geometric verification: an edge of the matching graph.
  kNoEdge,  // The pair was tested and did not pass.
  kFailed,  // The pair could not be tested: the verifier failed on it, and on it alone.
};

struct VerifiedPair {
  ImagePair pair;
  PairOutcome outcome = PairOutcome::kNoEdge;
  std::uint32_t num_inliers = 0;
  // Of descriptors, before geometric verification; negative: not known.
  std::int32_t num_matches = -1;
  // Tested before this run: one of KnownPairs().
  bool is_known = false;
};

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

// The entry of a pair in an ascending list, or null.
inline const VerifiedPair* FindPair(const std::vector<VerifiedPair>& ascending,
                                    const ImagePair& pair) {
  const auto place = std::lower_bound(
      ascending.begin(), ascending.end(), pair,
      [](const VerifiedPair& verified, const ImagePair& other) { return verified.pair < other; });
  return place != ascending.end() && place->pair == pair ? &*place : nullptr;
}

}  // namespace colmap_graphmatch
