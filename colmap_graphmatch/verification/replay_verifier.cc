#include "colmap_graphmatch/verification/replay_verifier.h"

#include <algorithm>
#include <utility>

namespace colmap_graphmatch {

ReplayVerifier::ReplayVerifier(std::unordered_map<ImagePair, std::uint32_t> edges)
    : edges_(std::move(edges)) {}

void ReplayVerifier::SetKnownPairs(std::vector<ImagePair> pairs) {
  std::sort(pairs.begin(), pairs.end());
  known_pairs_.clear();
  for (const ImagePair& pair : pairs) known_pairs_.push_back(Answer(pair));
}

VerifiedPair ReplayVerifier::Answer(const ImagePair& pair) const {
  const auto edge = edges_.find(pair);
  if (edge == edges_.end()) return {pair, PairOutcome::kNoEdge, 0};
  return {pair, PairOutcome::kEdge, edge->second};
}

bool ReplayVerifier::Verify(const std::vector<ImagePair>& pairs,
                            const std::function<void(const VerifiedPair&)>& on_verified) {
  for (const ImagePair& pair : pairs) on_verified(Answer(pair));
  return true;
}

}  // namespace colmap_graphmatch
