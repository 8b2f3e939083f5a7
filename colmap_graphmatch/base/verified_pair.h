#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

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

// The entry of a pair in an ascending list, or null.
inline const VerifiedPair* FindPair(const std::vector<VerifiedPair>& ascending,
                                    const ImagePair& pair) {
  const auto place = std::lower_bound(
      ascending.begin(), ascending.end(), pair,
      [](const VerifiedPair& verified, const ImagePair& other) { return verified.pair < other; });
  return place != ascending.end() && place->pair == pair ? &*place : nullptr;
}

}  // namespace colmap_graphmatch
