#include "colmap_graphmatch/graph/graphmatch.h"

#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/graph/explorer.h"
#include "colmap_graphmatch/graph/propagation.h"

namespace colmap_graphmatch {

GraphMatchProposer::GraphMatchProposer(const GraphMatchOptions& options, const Ranking& ranking,
                                       ThreadPool& threads)
    : options_(options),
      ranking_(ranking),
      threads_(threads),
      sampler_(options, ranking, threads),
      remaining_(options, threads) {
  options.Check();
}

std::optional<Proposal> GraphMatchProposer::Next(const MatchingGraph& graph) {
  if (graph.NumVertices() != ranking_.NumVertices()) {
    throw OptionsError("Every ranked image needs its id.");
  }
  // The samples of this iteration are tested: what they lead to is next. If that is nothing, the
  // loop goes on nevertheless, as sampling was not empty.
  if (has_sampled_) {
    if (std::optional<Proposal> pairs = ProposePropagation(graph)) return pairs;
  }
  ++iteration_;
  if (std::optional<Proposal> pairs = ProposeSamples(graph)) return pairs;
  return ProposePropagation(graph);  // Or nothing: both were empty.
}

std::optional<Proposal> GraphMatchProposer::ProposeSamples(const MatchingGraph& graph) {
  std::vector<VertexPair> pairs = sampler_.Propose(iteration_, graph);
  remaining_.OnSampling(iteration_, pairs.size(), sampler_.NumDrawn());
  has_sampled_ = !pairs.empty();
  if (pairs.empty()) return std::nullopt;
  return Proposal{std::move(pairs), LoopStage::kSampling, iteration_};
}

std::optional<Proposal> GraphMatchProposer::ProposePropagation(const MatchingGraph& graph) {
  has_sampled_ = false;
  std::vector<VertexPair> pairs = Propagate(options_, ranking_, graph, threads_);
  remaining_.OnPropagation(iteration_, pairs.size());
  if (pairs.empty()) return std::nullopt;
  return Proposal{std::move(pairs), LoopStage::kPropagation, iteration_};
}

void GraphMatchProposer::OnTested(const StageStatistics& batch) {
  remaining_.OnTested(has_sampled_ ? LoopStage::kSampling : LoopStage::kPropagation, batch);
}

ExpectedTests GraphMatchProposer::TestsAfter(const Proposal& proposal,
                                             const MatchingGraph& graph) const {
  return remaining_.After(proposal, graph);
}

namespace {

// Answers what was known before the run and takes everything else for no edge.
class KnownOnly : public PairVerifier {
 public:
  explicit KnownOnly(PairVerifier& verifier) : verifier_(verifier), known_(verifier.KnownPairs()) {}

  const std::vector<VerifiedPair>& KnownPairs() const override { return known_; }

  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override {
    for (const ImagePair& pair : pairs) {
      const VerifiedPair* known = FindPair(known_, pair);
      on_verified(known != nullptr ? *known : VerifiedPair{pair});
    }
    return true;
  }

  const FeatureMatches& Inliers(const ImagePair& pair) override { return verifier_.Inliers(pair); }

 private:
  PairVerifier& verifier_;
  const std::vector<VerifiedPair>& known_;
};

class ProposesNothing : public PairProposer {
 public:
  std::optional<Proposal> Next(const MatchingGraph& /*graph*/) override { return std::nullopt; }
};

}  // namespace

std::vector<ImagePair> ChooseSeeds(const GraphMatchOptions& options, const Ranking& ranking,
                                   const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                                   ThreadPool& threads,
                                   const std::vector<ImagePair>& earlier_seeds) {
  if (verifier.KnownPairs().empty()) return {};
  KnownOnly known_only(verifier);
  const OnProgress silent;
  ProposesNothing nothing;
  const std::size_t num_known = Explore(nothing, image_ids, known_only, silent).num_seed_pairs;
  const auto asks_for_all_known = [&](const std::vector<ImagePair>& seeds) {
    GraphMatchProposer proposer(options, ranking, threads);
    KnownPairsPolicy seeds_alone;
    seeds_alone.seeds = seeds;
    seeds_alone.others_join_in_the_end = false;
    const ExplorationResult rehearsed =
        Explore(proposer, image_ids, known_only, silent, seeds_alone);
    return rehearsed.num_seed_pairs + rehearsed.stages.All().num_known == num_known;
  };
  if (!earlier_seeds.empty() && asks_for_all_known(earlier_seeds)) return earlier_seeds;
  if (asks_for_all_known({})) return {};
  std::vector<ImagePair> all;
  for (const VerifiedPair& known : verifier.KnownPairs()) all.push_back(known.pair);
  return all;
}

}  // namespace colmap_graphmatch
