#include "colmap_graphmatch/graph/seeds.h"

#include <algorithm>

#include "colmap_graphmatch/graph/explorer.h"

namespace colmap_graphmatch {
namespace {

// Answers what was known before the run and takes everything else for no edge: a pair that failed,
// or one that an interruption left. Ends once all is asked for, and after a batch that is not known
// for the most part: an earlier run did not get farther.
class KnownOnly : public PairVerifier {
 public:
  // num_to_ask_for: those of the known pairs that end it.
  KnownOnly(PairVerifier& verifier, std::size_t num_to_ask_for, const StopRequest& stop)
      : verifier_(verifier),
        known_(verifier.KnownPairs()),
        num_to_ask_for_(num_to_ask_for),
        stop_(stop) {}

  const std::vector<VerifiedPair>& KnownPairs() const override { return known_; }

  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override {
    stop_.ThrowIfRequested();
    std::size_t num_known = 0;
    for (const ImagePair& pair : pairs) {
      const VerifiedPair* known = FindPair(known_, pair);
      if (known != nullptr) ++num_known;
      on_verified(known != nullptr ? *known : VerifiedPair{pair});
    }
    num_asked_for_ += num_known;
    constexpr std::size_t kSmallBatch = 10;  // Where failed pairs may be many.
    const bool is_mostly_unknown = pairs.size() > kSmallBatch && 2 * num_known < pairs.size();
    return num_asked_for_ < num_to_ask_for_ && !is_mostly_unknown;
  }

  const FeatureMatches& Inliers(const ImagePair& pair) override { return verifier_.Inliers(pair); }

 private:
  PairVerifier& verifier_;
  const std::vector<VerifiedPair>& known_;
  std::size_t num_to_ask_for_;
  std::size_t num_asked_for_ = 0;
  const StopRequest& stop_;
};

class ProposesNothing : public PairProposer {
 public:
  std::optional<Proposal> Next(const MatchingGraph& /*graph*/) override { return std::nullopt; }
};

}  // namespace

std::vector<ImagePair> ChooseSeeds(
    const std::function<std::unique_ptr<PairProposer>()>& make_proposer,
    const std::vector<ImageId>& image_ids, PairVerifier& verifier,
    const std::vector<ImagePair>& earlier_seeds, const StopRequest& stop) {
  if (verifier.KnownPairs().empty()) return {};
  const OnProgress silent;
  ProposesNothing nothing;
  KnownOnly all_known(verifier, 0, stop);
  const std::size_t num_known = Explore(nothing, image_ids, all_known, silent).num_seed_pairs;
  const auto asks_for_all_known = [&](const std::vector<ImagePair>& seeds) {
    const std::unique_ptr<PairProposer> proposer = make_proposer();
    KnownOnly known_only(verifier, num_known - std::min(num_known, seeds.size()), stop);
    KnownPairsPolicy seeds_alone;
    seeds_alone.seeds = seeds;
    seeds_alone.others_join_in_the_end = false;
    const ExplorationResult rehearsed =
        Explore(*proposer, image_ids, known_only, silent, seeds_alone);
    return rehearsed.num_seed_pairs + rehearsed.stages.All().num_known == num_known;
  };
  if (!earlier_seeds.empty() && asks_for_all_known(earlier_seeds)) return earlier_seeds;
  if (asks_for_all_known({})) return {};
  std::vector<ImagePair> all;
  for (const VerifiedPair& known : verifier.KnownPairs()) all.push_back(known.pair);
  return all;
}

}  // namespace colmap_graphmatch
