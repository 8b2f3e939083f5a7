#pragma once

#include <cstddef>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// The sampling stage (GraphMatch, section 3.2): every vertex with fewer than max_num_neighbors
// neighbours proposes the next untested ones of its ranked list.
class Sampler {
 public:
  Sampler(const GraphMatchOptions& options, const Ranking& ranking, ThreadPool& threads);

  // The pairs to test in an iteration (counted from 0), ascending, each once. Degrees and tested
  // pairs are those of the graph as it is now. Each vertex spends what it draws of its budget, so
  // to be called for proposals that are tested.
  std::vector<VertexPair> Propose(int iteration, const MatchingGraph& graph);

  // The pairs that the vertices drew in the last proposal: more than it has, as two may draw each
  // other.
  std::size_t NumDrawn() const;

  // Spends the budget of every vertex on the tested pairs among the first MaxTestsForSampling of
  // its ranked list: whoever tested them did what sampling would have done. Vertices without any
  // tested pair do not count in the list: images that were added since are not the task of those
  // that have been sampled.
  void SpendOnTested(const MatchingGraph& graph);

 private:
  // Counts how many draws of the vertex in a row were no edges, with the last proposal; true if it
  // has a neighbour and they are enough for it to draw no more.
  bool GivesUp(Vertex vertex, const MatchingGraph& graph);

  // Moves the cursor of the vertex past tested images and returns up to num untested ones behind
  // it.
  std::vector<Vertex> NextUntested(Vertex vertex, std::size_t num, const MatchingGraph& graph);

  GraphMatchOptions options_;
  const Ranking& ranking_;
  ThreadPool& threads_;
  std::vector<std::size_t> cursors_;  // By vertex: all before this place of its list are tested.
  std::vector<int> num_drawn_;        // By vertex: spent of the budget.
  std::vector<int> num_failed_;       // By vertex: its last draws in a row without an edge.
  std::vector<std::vector<Vertex>> drawn_;  // By vertex: the last proposal.
};

}  // namespace colmap_graphmatch
