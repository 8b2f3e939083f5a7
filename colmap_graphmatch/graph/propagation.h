#pragma once

#include <cstddef>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// The propagation stage (GraphMatch, section 3.3): along every edge (A, B), and (B, A), if A has
// fewer than max_num_neighbors neighbours, up to num_to_propagate neighbours C of B that were not
// tested with A and look most like it are proposed as pairs (A, C). Returns the pairs ascending,
// each once.
std::vector<VertexPair> Propagate(const GraphMatchOptions& options, const Ranking& ranking,
                                  const MatchingGraph& graph, ThreadPool& threads);

// The untested pairs that propagation could propose along all edges if num_to_propagate were no
// limit.
std::size_t CountOpenPairs(const GraphMatchOptions& options, const MatchingGraph& graph,
                           ThreadPool& threads);

}  // namespace colmap_graphmatch
