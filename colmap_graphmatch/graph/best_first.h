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
  // ranking, priors and threads must outlive it. Throws OptionsError.
  BestFirstProposer(const BestFirstOptions& options, const Ranking& ranking,
                    const ImagePriors& priors, ThreadPool& threads);
  ~BestFirstProposer() override = default;
  BestFirstProposer(const BestFirstProposer&) = delete;
  BestFirstProposer& operator=(const BestFirstProposer&) = delete;

  std::optional<Proposal> Next(const MatchingGraph& graph) override;
  void OnVerified(const TestedVertexPair& pair, const InlierReader& inliers) override;
  void OnTested(const StageStatistics& batch) override;
  void OnKnown(const MatchingGraph& graph) override;
  ExpectedTests TestsAfter(const Proposal& proposal, const MatchingGraph& graph) const override;

 private:
  // Those as likely as asked for, and the pairs of lonely images: the likeliest num of them,
  // ascending.
  std::vector<VertexPair> Likeliest(std::size_t num, std::size_t num_nearest, std::size_t num_near,
                                    double min_probability, const MatchingGraph& graph);
  void Learn(const std::vector<LabelledCues>& tests);
  // Brings the evidence up to date with the graph.
  void TakeNote(const MatchingGraph& graph);

  const BestFirstOptions options_;
  const Ranking& ranking_;
  ThreadPool& threads_;
  PairEvidence evidence_;
  SharedTracks tracks_;
  EdgeModel model_;
  std::vector<LabelledCues> proposed_;     // What was known of the last proposal when it was made,
  std::vector<VertexPair> pairs_;          // ascending, and what became of it.
  std::vector<TestedVertexPair> joining_;  // Tests that the evidence does not know yet,
  std::vector<TestedVertexPair> known_;    // and those of them that nobody had proposed.
  std::vector<LabelledCues> tested_;       // What the model learns from.
  ExpectedTests expected_;
  int num_batches_ = 0;
};

}  // namespace colmap_graphmatch
