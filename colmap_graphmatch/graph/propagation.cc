#include "colmap_graphmatch/graph/propagation.h"

#include <algorithm>
#include <utility>

namespace colmap_graphmatch {
namespace {

// Edges a parallel task: enough work to make up for starting it.
constexpr std::size_t kEdgesPerTask = 64;

// What (a, b) proposes: pairs of a with neighbours of b.
void PropagateAlong(Vertex a, Vertex b, const GraphMatchOptions& options, const Ranking& ranking,
                    const MatchingGraph& graph, std::vector<VertexPair>* pairs) {
  if (!options.restrictions.Seeks(a)) return;
  if (graph.Degree(a) >= static_cast<std::size_t>(options.max_num_neighbors)) return;
  std::vector<std::pair<float, Vertex>> candidates;
  for (const Vertex c : graph.Neighbors(b)) {
    if (c == a || options.restrictions.SameFrame(a, c)) continue;
    if (options.propagate_untested_only && graph.IsTested(a, c)) continue;
    const bool from_source =
        options.propagation_distance == GraphMatchOptions::PropagationDistance::kSource;
    candidates.emplace_back(ranking.Distance(from_source ? a : b, c), c);
  }
  const auto num = static_cast<std::ptrdiff_t>(
      std::min(candidates.size(), static_cast<std::size_t>(options.num_to_propagate)));
  std::partial_sort(candidates.begin(), candidates.begin() + num, candidates.end());
  for (auto candidate = candidates.begin(); candidate != candidates.begin() + num; ++candidate) {
    if (!graph.IsTested(a, candidate->second)) {
      pairs->push_back(MakeVertexPair(a, candidate->second));
    }
  }
}

}  // namespace

std::vector<VertexPair> Propagate(const GraphMatchOptions& options, const Ranking& ranking,
                                  const MatchingGraph& graph, std::size_t first_edge,
                                  ThreadPool& threads) {
  const std::vector<VertexPair>& edges = graph.Edges();
  if (first_edge >= edges.size()) return {};
  const std::size_t num_tasks = (edges.size() - first_edge + kEdgesPerTask - 1) / kEdgesPerTask;
  std::vector<std::vector<VertexPair>> proposals(num_tasks);
  threads.ParallelFor(num_tasks, [&](std::size_t task) {
    const std::size_t begin = first_edge + task * kEdgesPerTask;
    const std::size_t end = std::min(begin + kEdgesPerTask, edges.size());
    for (std::size_t i = begin; i < end; ++i) {
      const auto [a, b] = edges[i];
      PropagateAlong(a, b, options, ranking, graph, &proposals[task]);
      PropagateAlong(b, a, options, ranking, graph, &proposals[task]);
    }
  });
  return UniteProposals(proposals);
}

}  // namespace colmap_graphmatch
