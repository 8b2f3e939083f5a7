#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/graph/edge_model.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/graph/pair_evidence.h"
#include "colmap_graphmatch/graph/pair_proposer.h"
#include "colmap_graphmatch/graph/shared_tracks.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// The paper's two moves, sampling and propagation (GraphMatch, section 3), over one queue: of all
// pairs that either could test, the likeliest are tested next. How likely a pair is, a model of the
// evidence says (PairEvidence, EdgeModel) that is fitted anew to all tests after every batch.
class BestFirstProposer : public PairProposer {
 public:
  // ranking and threads must outlive it. Throws OptionsError.
  BestFirstProposer(const BestFirstOptions& options, const Ranking& ranking, ThreadPool& threads);
  ~BestFirstProposer() override = default;
  BestFirstProposer(const BestFirstProposer&) = delete;
  BestFirstProposer& operator=(const BestFirstProposer&) = delete;

  std::optional<Proposal> Next(const MatchingGraph& graph) override;
  void OnVerified(const TestedVertexPair& pair, const InlierReader& inliers) override;
  void OnTested(const StageStatistics& batch) override;
  void OnKnown(const MatchingGraph& graph) override;
  ExpectedTests TestsAfter(const Proposal& proposal, const MatchingGraph& graph) const override;

 private:
  // The next batch, once there are tests to learn from.
  std::vector<Candidate> Likeliest(const MatchingGraph& graph);
  // Keeps what the model looks at.
  void ForgetOldTests();

  const BestFirstOptions options_;
  const Ranking& ranking_;
  PairEvidence evidence_;
  SharedTracks tracks_;
  EdgeModel model_;
  std::vector<Candidate> proposed_;        // Ascending: the last proposal,
  std::vector<bool> are_edges_;            // and what became of it.
  std::vector<TestedVertexPair> joining_;  // Known pairs, which the graph is about to get.
  std::vector<LabelledCues> tested_;       // What was known of them when they were proposed.
  ExpectedTests expected_;
  int num_batches_ = 0;
};

}  // namespace colmap_graphmatch
