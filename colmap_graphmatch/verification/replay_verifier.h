#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// What a finished matching graph knows of a pair.
struct ReplayedPair {
  std::uint32_t num_inliers = 0;
  bool is_edge = false;
  bool is_verified = true;  // The pair had enough matches for the geometric verification.
};

// Answers from a finished matching graph instead of matching: pairs among the given ones as they
// are, all others are no edges and have too few matches to be verified. For tests and for comparing
// strategies on the same truth.
class ReplayVerifier : public PairVerifier {
 public:
  explicit ReplayVerifier(std::unordered_map<ImagePair, ReplayedPair> pairs);

  // Edges and their numbers of inliers.
  explicit ReplayVerifier(const std::unordered_map<ImagePair, std::uint32_t>& edges);

  // From these the time of tests is modelled. num_features: of every image that is asked for.
  // Without this, tests take no time.
  void SetCosts(std::unordered_map<ImageId, std::size_t> num_features, int num_threads);

  // Reads the inlier matches of a pair. Without this there are none.
  void SetInliers(std::function<FeatureMatches(const ImagePair&)> read_inliers) {
    read_inliers_ = std::move(read_inliers);
  }

  // Answers no more when this asks for it.
  void SetStop(const StopRequest* stop) { stop_ = stop; }

  // What the answered pairs would have taken, shared by the threads evenly. Also counts the pair
  // that is being reported.
  double ModelledSeconds() const { return modelled_seconds_; }

  // None: nothing was tested before a replay.
  const std::vector<VerifiedPair>& KnownPairs() const override;
  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override;
  const FeatureMatches& Inliers(const ImagePair& pair) override;

 private:
  VerifiedPair Answer(const ImagePair& pair) const;
  double Cost(const ImagePair& pair) const;

  std::unordered_map<ImagePair, ReplayedPair> pairs_;
  std::unordered_map<ImageId, std::size_t> num_features_;
  int num_threads_ = 1;
  std::function<FeatureMatches(const ImagePair&)> read_inliers_;
  FeatureMatches inliers_;  // Read last.
  const StopRequest* stop_ = nullptr;
  double modelled_seconds_ = 0;
};

}  // namespace colmap_graphmatch
