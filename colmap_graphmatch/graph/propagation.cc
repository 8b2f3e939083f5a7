#include "colmap_graphmatch/graph/propagation.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

namespace colmap_graphmatch {
namespace {

// Vertices a parallel task: enough work to make up for the arrays of SourceCandidates.
constexpr std::size_t kVerticesPerTask = 128;

constexpr Vertex kNoVertex = std::numeric_limits<Vertex>::max();

// What is known of the pairs of one vertex with others. Neighbours of a vertex have most of their
// neighbours in common, so a pair comes up many times in one iteration, and its distance is a
// product of two long vectors.
class SourceCandidates {
 public:
  SourceCandidates(const GraphMatchOptions& options, const Ranking& ranking,
                   const MatchingGraph& graph)
      : options_(options),
        ranking_(ranking),
        graph_(graph),
        source_of_(ranking.NumVertices(), kNoVertex),
        entries_(ranking.NumVertices()) {}

  // What (a, b) proposes, for every neighbour b of a: pairs of a with neighbours of b.
  void Propagate(Vertex a, std::vector<VertexPair>* pairs) {
    if (!options_.restrictions.IsQuery(a)) return;
    if (graph_.Degree(a) >= static_cast<std::size_t>(options_.max_num_neighbors)) return;
    for (const Vertex b : graph_.Neighbors(a)) {
      candidates_.clear();
      for (const Vertex c : graph_.Neighbors(b)) {
        if (c == a) continue;
        const Entry& entry = Get(a, c);
        if (entry.is_candidate) candidates_.emplace_back(entry.distance, c);
      }
      const auto num = static_cast<std::ptrdiff_t>(
          std::min(candidates_.size(), static_cast<std::size_t>(options_.num_to_propagate)));
      std::partial_sort(candidates_.begin(), candidates_.begin() + num, candidates_.end());
      for (auto candidate = candidates_.begin(); candidate != candidates_.begin() + num;
           ++candidate) {
        pairs->push_back(MakeVertexPair(a, candidate->second));
      }
    }
  }

 private:
  struct Entry {
    float distance = 0;  // d(a, c), of candidates.
    bool is_candidate = false;
  };

  const Entry& Get(Vertex a, Vertex c) {
    Entry& entry = entries_[c];
    if (source_of_[c] == a) return entry;
    source_of_[c] = a;
    entry.is_candidate = !options_.restrictions.SameFrame(a, c) && !graph_.IsTested(a, c);
    if (entry.is_candidate) entry.distance = ranking_.Distance(a, c);
    return entry;
  }

  const GraphMatchOptions& options_;
  const Ranking& ranking_;
  const MatchingGraph& graph_;
  std::vector<Vertex> source_of_;  // By c: the vertex a that its entry belongs to.
  std::vector<Entry> entries_;     // By c.
  std::vector<std::pair<float, Vertex>> candidates_;
};

}  // namespace

std::vector<VertexPair> Propagate(const GraphMatchOptions& options, const Ranking& ranking,
                                  const MatchingGraph& graph, ThreadPool& threads) {
  if (graph.NumEdges() == 0) return {};
  const std::size_t num_vertices = graph.NumVertices();
  const std::size_t num_tasks = (num_vertices + kVerticesPerTask - 1) / kVerticesPerTask;
  std::vector<std::vector<VertexPair>> proposals(num_tasks);
  threads.ParallelFor(num_tasks, [&](std::size_t task) {
    SourceCandidates candidates(options, ranking, graph);
    const std::size_t end = std::min((task + 1) * kVerticesPerTask, num_vertices);
    for (std::size_t i = task * kVerticesPerTask; i < end; ++i) {
      candidates.Propagate(static_cast<Vertex>(i), &proposals[task]);
    }
  });
  return UniteProposals(proposals);
}

std::size_t CountOpenPairs(const GraphMatchOptions& options, const MatchingGraph& graph,
                           ThreadPool& threads) {
  const auto looks_for_more = [&](Vertex a) {
    return options.restrictions.IsQuery(a) &&
           graph.Degree(a) < static_cast<std::size_t>(options.max_num_neighbors);
  };
  const std::size_t num_vertices = graph.NumVertices();
  const std::size_t num_tasks = (num_vertices + kVerticesPerTask - 1) / kVerticesPerTask;
  std::vector<std::size_t> counts(num_tasks);
  threads.ParallelFor(num_tasks, [&](std::size_t task) {
    std::vector<Vertex> seen_from(num_vertices, kNoVertex);
    const std::size_t end = std::min((task + 1) * kVerticesPerTask, num_vertices);
    for (std::size_t i = task * kVerticesPerTask; i < end; ++i) {
      const auto a = static_cast<Vertex>(i);
      if (!looks_for_more(a)) continue;
      seen_from[a] = a;
      for (const Vertex b : graph.Neighbors(a)) {
        for (const Vertex c : graph.Neighbors(b)) {
          if (seen_from[c] == a) continue;
          seen_from[c] = a;
          // Of two vertices that look for more the smaller counts their pair.
          if ((c < a && looks_for_more(c)) || graph.IsTested(a, c) ||
              options.restrictions.SameFrame(a, c)) {
            continue;
          }
          ++counts[task];
        }
      }
    }
  });
  return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

}  // namespace colmap_graphmatch
