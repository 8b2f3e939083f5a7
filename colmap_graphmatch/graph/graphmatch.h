#pragma once

#include <optional>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/graph/pair_proposer.h"
#include "colmap_graphmatch/graph/remaining_tests.h"
#include "colmap_graphmatch/graph/sampling.h"
#include "colmap_graphmatch/graph/stages.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// The paper's loop (GraphMatch, section 3; the pseudo-code is in docs/design.md): sampling and
// propagation take turns until neither proposes anything.
class GraphMatchProposer : public PairProposer {
 public:
  // ranking and threads must outlive it. Throws OptionsError.
  GraphMatchProposer(const GraphMatchOptions& options, const Ranking& ranking, ThreadPool& threads);

  std::optional<Proposal> Next(const MatchingGraph& graph) override;
  void OnTested(const StageStatistics& batch) override;
  void OnKnown(const MatchingGraph& graph) override { sampler_.SpendOnTested(graph); }
  ExpectedTests TestsAfter(const Proposal& proposal, const MatchingGraph& graph) const override;

 private:
  // One half of the iteration; nothing if it has no pairs.
  std::optional<Proposal> ProposeSamples(const MatchingGraph& graph);
  std::optional<Proposal> ProposePropagation(const MatchingGraph& graph);

  const GraphMatchOptions options_;
  const Ranking& ranking_;
  ThreadPool& threads_;
  Sampler sampler_;
  RemainingTests remaining_;
  int iteration_ = -1;        // Of the last proposal.
  bool has_sampled_ = false;  // The last proposal was samples.
};

}  // namespace colmap_graphmatch
