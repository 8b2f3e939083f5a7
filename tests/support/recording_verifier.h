#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// Answers from a set of edges, remembers what it was asked, and fails or stops where it is told to.
class RecordingVerifier : public PairVerifier {
 public:
  explicit RecordingVerifier(std::set<ImagePair> edges) : edges_(std::move(edges)) {}

  std::set<ImagePair> known;    // Tested before the run.
  std::set<ImagePair> failing;  // Pairs that cannot be tested.
  std::size_t stop_after =
      std::numeric_limits<std::size_t>::max();  // Pairs tested, known ones apart.

  std::vector<std::vector<ImagePair>> batches;
  std::vector<ImagePair> tested;  // In the order in which they were tested; known ones are not.

  const std::vector<VerifiedPair>& KnownPairs() const override {
    known_pairs_.clear();
    for (const ImagePair& pair : known) known_pairs_.push_back(Answer(pair));
    return known_pairs_;
  }

  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override {
    batches.push_back(pairs);
    bool complete = true;
    // Backwards: the loop must not rely on the order of the answers.
    for (auto pair = pairs.rbegin(); pair != pairs.rend(); ++pair) {
      if (known.count(*pair) == 0) {
        if (tested.size() >= stop_after) {
          complete = false;
          continue;
        }
        tested.push_back(*pair);
      }
      on_verified(Answer(*pair));
    }
    return complete;
  }

  // Of edges: the ids of the images.
  const FeatureMatches& Inliers(const ImagePair& pair) override {
    inliers_.clear();
    if (edges_.count(pair) > 0) inliers_.push_back({pair.id1, pair.id2});
    return inliers_;
  }

 private:
  VerifiedPair Answer(const ImagePair& pair) const {
    if (failing.count(pair) > 0) return {pair, PairOutcome::kFailed, 0};
    const bool is_edge = edges_.count(pair) > 0;
    return {pair, is_edge ? PairOutcome::kEdge : PairOutcome::kNoEdge, 20, -1,
            known.count(pair) > 0};
  }

  std::set<ImagePair> edges_;
  FeatureMatches inliers_;
  mutable std::vector<VerifiedPair> known_pairs_;  // `known` with its answers.
};

}  // namespace colmap_graphmatch
