#include "colmap_graphmatch/verification/replay_verifier.h"

#include <utility>

namespace colmap_graphmatch {
namespace {

// What testing a pair costs, in seconds of one core. Measured with the exact matcher on VNNI and
// COLMAP 3.8, on 569 photos with 2,815 features each (docs/benchmarks.md, the whole job: 29 s for
// 11,099 pairs, and 24 ms for each of 5,553).
constexpr double kSecondsPerMillionProducts = 3.3e-4;  // Of matching n1 with n2 descriptors: n1 n2.
constexpr double kSecondsPerVerification = 0.024;

}  // namespace

ReplayVerifier::ReplayVerifier(std::unordered_map<ImagePair, ReplayedPair> pairs)
    : pairs_(std::move(pairs)) {}

ReplayVerifier::ReplayVerifier(const std::unordered_map<ImagePair, std::uint32_t>& edges) {
  for (const auto& [pair, num_inliers] : edges) pairs_[pair] = {num_inliers, true, true};
}

void ReplayVerifier::SetCosts(std::unordered_map<ImageId, std::size_t> num_features,
                              int num_threads) {
  num_features_ = std::move(num_features);
  num_threads_ = num_threads;
}

const std::vector<VerifiedPair>& ReplayVerifier::KnownPairs() const {
  static const std::vector<VerifiedPair> none;
  return none;
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
  return kSecondsPerMillionProducts * num_products / 1e6 +
         (is_verified ? kSecondsPerVerification : 0);
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

const FeatureMatches& ReplayVerifier::Inliers(const ImagePair& pair) {
  inliers_.clear();
  if (read_inliers_) inliers_ = read_inliers_(pair);
  return inliers_;
}

}  // namespace colmap_graphmatch
