#include "colmap_graphmatch/graph/graphmatch.h"

#include <utility>

#include "colmap_graphmatch/base/errors.h"
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

}  // namespace colmap_graphmatch
