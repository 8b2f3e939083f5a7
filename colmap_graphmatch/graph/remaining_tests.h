#pragma once

#include <cstddef>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/graph/pair_proposer.h"
#include "colmap_graphmatch/graph/stages.h"

namespace colmap_graphmatch {

// An estimate of the tests that the loop is still to make: sampling goes on at its pace, and
// propagation tests what it could propose now and what the edges among that lead to.
class RemainingTests {
 public:
  RemainingTests(const GraphMatchOptions& options, ThreadPool& threads)
      : options_(options), threads_(threads) {}

  // num_pairs: the pairs of a sampling, num_drawn: how often they were drawn.
  void OnSampling(int iteration, std::size_t num_pairs, std::size_t num_drawn);
  void OnPropagation(int iteration, std::size_t num_pairs);
  void OnTested(LoopStage stage, const StageStatistics& batch);

  ExpectedTests After(const Proposal& proposal, const MatchingGraph& graph) const;

 private:
  GraphMatchOptions options_;
  ThreadPool& threads_;
  StageStatistics last_sampling_;
  StageStatistics last_propagation_;
  double sampling_batch_ = 0;  // Expected tests of each sampling to come.
  int iteration_ = 0;
};

}  // namespace colmap_graphmatch
