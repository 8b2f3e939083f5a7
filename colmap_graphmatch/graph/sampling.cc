#include "colmap_graphmatch/graph/sampling.h"

#include <algorithm>

namespace colmap_graphmatch {

Sampler::Sampler(const GraphMatchOptions& options, const Ranking& ranking, ThreadPool& threads)
    : options_(options),
      ranking_(ranking),
      threads_(threads),
      cursors_(ranking.NumVertices()),
      num_drawn_(ranking.NumVertices()),
      num_failed_(ranking.NumVertices()),
      drawn_(ranking.NumVertices()) {}

bool Sampler::GivesUp(Vertex vertex, const MatchingGraph& graph) {
  const std::vector<Vertex>& neighbors = graph.Neighbors(vertex);
  for (const Vertex other : drawn_[vertex]) {
    const bool is_edge = std::binary_search(neighbors.begin(), neighbors.end(), other);
    num_failed_[vertex] = is_edge ? 0 : num_failed_[vertex] + 1;
  }
  return options_.max_failed_samples > 0 && !neighbors.empty() &&
         num_failed_[vertex] >= options_.max_failed_samples;
}

std::vector<Vertex> Sampler::NextUntested(Vertex vertex, std::size_t num,
                                          const MatchingGraph& graph) {
  std::vector<Vertex> untested;
  std::size_t& cursor = cursors_[vertex];
  bool only_tested_so_far = true;
  const auto scan = [&](const std::vector<Vertex>& list) {
    untested.clear();
    only_tested_so_far = true;
    for (std::size_t i = cursor; i < list.size() && untested.size() < num; ++i) {
      if (graph.IsTested(vertex, list[i]) || options_.restrictions.SameFrame(vertex, list[i])) {
        if (only_tested_so_far) cursor = i + 1;
        continue;
      }
      only_tested_so_far = false;
      untested.push_back(list[i]);
    }
  };
  const std::vector<Vertex>& nearest = ranking_.NearestOf(vertex);
  scan(nearest);
  if (untested.size() < num && nearest.size() + 1 < ranking_.NumVertices()) {
    scan(ranking_.AllOf(vertex));
  }
  return untested;
}

std::vector<VertexPair> Sampler::Propose(int iteration, const MatchingGraph& graph) {
  const std::size_t num_vertices = ranking_.NumVertices();
  const int budget = options_.MaxTestsForSampling(num_vertices);
  const int tests = options_.TestsInIteration(iteration, num_vertices);
  threads_.ParallelFor(num_vertices, [&](std::size_t i) {
    const auto vertex = static_cast<Vertex>(i);
    const bool gives_up = GivesUp(vertex, graph);
    drawn_[i].clear();
    const int num = std::min(tests, budget - num_drawn_[i]);
    if (num <= 0 || gives_up || !options_.restrictions.IsQuery(vertex) ||
        graph.Degree(vertex) >= static_cast<std::size_t>(options_.max_num_neighbors)) {
      return;
    }
    drawn_[i] = NextUntested(vertex, static_cast<std::size_t>(num), graph);
    num_drawn_[i] += static_cast<int>(drawn_[i].size());
  });
  std::vector<VertexPair> pairs;
  for (Vertex vertex = 0; vertex < num_vertices; ++vertex) {
    for (const Vertex other : drawn_[vertex]) pairs.push_back(MakeVertexPair(vertex, other));
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

std::size_t Sampler::NumDrawn() const {
  std::size_t num_drawn = 0;
  for (const std::vector<Vertex>& drawn : drawn_) num_drawn += drawn.size();
  return num_drawn;
}

void Sampler::SpendOnTested(const MatchingGraph& graph) {
  const std::size_t num_vertices = ranking_.NumVertices();
  const int budget = options_.MaxTestsForSampling(num_vertices);
  // What the iterations leave of the budget.
  const int num_planned = std::min(
      budget, options_.number_sample_iterations * options_.TestsInIteration(0, num_vertices));
  threads_.ParallelFor(num_vertices, [&](std::size_t i) {
    const auto vertex = static_cast<Vertex>(i);
    if (graph.NumTestedOf(vertex) == 0) return;
    int num_seen = 0;
    int num_tested = 0;
    for (const Vertex other : ranking_.NearestOf(vertex)) {
      if (num_seen == budget) break;
      if (graph.NumTestedOf(other) == 0 || options_.restrictions.SameFrame(vertex, other)) continue;
      ++num_seen;
      num_tested += graph.IsTested(vertex, other) ? 1 : 0;
    }
    const bool done = num_tested >= std::min(num_planned, num_seen);
    num_drawn_[i] = std::max(num_drawn_[i], done ? budget : num_tested);
  });
}

}  // namespace colmap_graphmatch
