#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// Answers from a finished matching graph instead of matching: pairs among the edges are edges, all
// others are not. For tests and for comparing strategies on the same truth.
class ReplayVerifier : public PairVerifier {
 public:
  // Edges and their numbers of inliers.
  explicit ReplayVerifier(std::unordered_map<ImagePair, std::uint32_t> edges);

  // Makes pairs known that were tested before the run; their outcomes come from the edges.
  void SetKnownPairs(std::vector<ImagePair> pairs);

  const std::vector<VerifiedPair>& KnownPairs() const override { return known_pairs_; }
  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override;

 private:
  VerifiedPair Answer(const ImagePair& pair) const;

  std::unordered_map<ImagePair, std::uint32_t> edges_;
  std::vector<VerifiedPair> known_pairs_;
};

}  // namespace colmap_graphmatch
