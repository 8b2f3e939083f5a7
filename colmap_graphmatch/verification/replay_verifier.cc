#include "colmap_graphmatch/verification/replay_verifier.h"

#include <algorithm>
#include <utility>

namespace colmap_graphmatch {

ReplayVerifier::ReplayVerifier(std::unordered_map<ImagePair, ReplayedPair> pairs)
    : pairs_(std::move(pairs)) {}

ReplayVerifier::ReplayVerifier(const std::unordered_map<ImagePair, std::uint32_t>& edges) {
  for (const auto& [pair, num_inliers] : edges) pairs_[pair] = {num_inliers, true, true};
}

void ReplayVerifier::SetKnownPairs(std::vector<ImagePair> pairs) {
  std::sort(pairs.begin(), pairs.end());
  known_pairs_.clear();
  for (const ImagePair& pair : pairs) known_pairs_.push_back(Answer(pair));
}

void ReplayVerifier::SetCosts(const ReplayCosts& costs,
                              std::unordered_map<ImageId, std::size_t> num_features,
                              int num_threads) {
  costs_ = costs;
  num_features_ = std::move(num_features);
  num_threads_ = num_threads;
}

VerifiedPair ReplayVerifier::Answer(const ImagePair& pair) const {
  const auto found = pairs_.find(pair);
  if (found == pairs_.end()) return {pair, PairOutcome::kNoEdge, 0};
  const ReplayedPair& replayed = found->second;
  return {pair, replayed.is_edge ? PairOutcome::kEdge : PairOutcome::kNoEdge, replayed.num_inliers};
}

double ReplayVerifier::Cost(const ImagePair& pair) const {
  if (num_features_.empty()) return 0;
  const auto num_products = static_cast<double>(num_features_.at(pair.id1)) *
                            static_cast<double>(num_features_.at(pair.id2));
  const auto found = pairs_.find(pair);
  const bool is_verified = found != pairs_.end() && found->second.is_verified;
  return costs_.seconds_per_million_products * num_products / 1e6 +
         (is_verified ? costs_.seconds_per_verification : 0);
}

bool ReplayVerifier::Verify(const std::vector<ImagePair>& pairs,
                            const std::function<void(const VerifiedPair&)>& on_verified) {
  for (const ImagePair& pair : pairs) {
    if (stop_ != nullptr && stop_->Requested()) return false;
    modelled_seconds_ += Cost(pair) / num_threads_;
    on_verified(Answer(pair));
  }
  return true;
}

}  // namespace colmap_graphmatch
