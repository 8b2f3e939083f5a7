#pragma once

#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/graph/components.h"
#include "colmap_graphmatch/graph/exploration.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/pair_proposer.h"

namespace colmap_graphmatch {

// A matching graph that grows batch by batch as a verifier tests pairs, with the statistics of how
// it came about. The arguments of the constructor must outlive it.
class GraphBuilder {
 public:
  // image_ids: the image of every vertex, ascending. Throws OptionsError if they are not.
  GraphBuilder(const std::vector<ImageId>& image_ids, PairVerifier& verifier,
               const OnProgress& on_progress);

  const MatchingGraph& Graph() const { return graph_; }

  // Adds the known pairs that are not in the graph: all, or those of an ascending list. Returns
  // true if there were any. The proposer is told of each.
  bool AddKnown(PairProposer& proposer);
  bool AddKnown(const std::vector<ImagePair>& pairs, PairProposer& proposer);

  // Has the proposed pairs tested, and adds them. Returns the statistics of this batch alone.
  // Throws std::logic_error if the pairs do not ascend, before any is tested.
  StageStatistics Verify(const Proposal& proposal, PairProposer& proposer);

  // False once the verifier was asked to stop: nothing more is to be verified.
  bool Continues() const { return result_.finished; }

  // What was found. The builder is of no use after it.
  ExplorationResult Finish();

 private:
  std::vector<TestedVertexPair> KnownOutsideGraph() const;
  bool AddSeeds(const std::vector<TestedVertexPair>& seeds, PairProposer& proposer);
  void Tell(const TestedVertexPair& pair, PairProposer& proposer);
  void KeepIteration(const Proposal& proposal, const StageStatistics& batch);
  void Report(LoopProgress progress, std::size_t num_edges_in_batch);

  const std::vector<ImageId>& image_ids_;
  PairVerifier& verifier_;
  const OnProgress& on_progress_;
  MatchingGraph graph_;
  Components components_;
  ExplorationResult result_;
};

}  // namespace colmap_graphmatch
