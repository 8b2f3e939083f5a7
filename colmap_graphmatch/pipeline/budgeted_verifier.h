#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/pipeline/options.h"

namespace colmap_graphmatch {

// Has another verifier test pairs as long as a budget lasts. Of a batch that is too much for what
// is left, the most promising pairs are tested; then, and when time is over, Verify returns false,
// as if the verifier had been asked to stop.
class BudgetedVerifier : public PairVerifier {
 public:
  enum class Limit { kNone, kMaxPairs, kMaxMinutes };

  // How promising a pair is: smaller is tested first, ties by the pair. Empty: in ascending order.
  using Order = std::function<double(const ImagePair&)>;

  // seconds: since the start of the run. num_threads: of the verifier. Both verifiers share what
  // is known.
  BudgetedVerifier(PairVerifier& verifier, const TestBudget& budget, int num_threads,
                   std::function<double()> seconds, Order order);

  const std::vector<VerifiedPair>& KnownPairs() const override { return verifier_.KnownPairs(); }
  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override;
  const FeatureMatches& Inliers(const ImagePair& pair) override { return verifier_.Inliers(pair); }

  // What ended the run; kNone as long as nothing did.
  Limit Reached() const { return reached_; }

 private:
  void SortByPromise(std::vector<ImagePair>* pairs) const;
  bool VerifyInTime(std::vector<ImagePair> pairs,
                    const std::function<void(const VerifiedPair&)>& on_verified);

  PairVerifier& verifier_;
  TestBudget budget_;
  std::size_t min_chunk_;
  std::function<double()> seconds_;
  Order order_;
  std::size_t num_tested_ = 0;
  double seconds_per_pair_ = 0;  // Of the last chunk; 0: not known yet.
  Limit reached_ = Limit::kNone;
};

}  // namespace colmap_graphmatch
