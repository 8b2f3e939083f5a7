#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// The loop as its pseudo-code reads (docs/design.md), one vertex and one edge after the other, with
// sets and full sorted lists: slow and plain, to hold the real one against. Returns the batches in
// their order.
inline std::vector<std::set<VertexPair>> ReferenceGraphMatch(const GraphMatchOptions& options,
                                                             const Ranking& ranking,
                                                             const std::set<VertexPair>& truth) {
  const auto n = static_cast<Vertex>(ranking.NumVertices());
  const auto by_distance_to = [&](Vertex from) {
    return [&ranking, from](Vertex a, Vertex b) {
      return std::make_pair(ranking.Distance(from, a), a) <
             std::make_pair(ranking.Distance(from, b), b);
    };
  };
  std::map<Vertex, std::set<Vertex>> neighbors;
  std::vector<VertexPair> edges;
  std::set<VertexPair> tested;
  std::map<Vertex, int> drawn;
  std::map<Vertex, std::vector<Vertex>> last_drawn;
  std::map<Vertex, int> failed;
  std::vector<std::set<VertexPair>> batches;

  const auto full = [&](Vertex v) {
    return neighbors[v].size() >= static_cast<std::size_t>(options.max_num_neighbors);
  };
  const auto verify = [&](const std::set<VertexPair>& pairs) {
    for (const VertexPair& pair : pairs) {
      tested.insert(pair);
      if (truth.count(pair) == 0) continue;
      neighbors[pair.first].insert(pair.second);
      neighbors[pair.second].insert(pair.first);
      edges.push_back(pair);
    }
    if (!pairs.empty()) batches.push_back(pairs);
  };

  for (int iteration = 0;; ++iteration) {
    std::set<VertexPair> sampled;
    if (iteration < options.number_sample_iterations) {
      for (Vertex i = 0; i < n; ++i) {
        const int left = options.MaxTestsForSampling(n) - drawn[i];
        int wanted = std::min(left, options.TestsInIteration(iteration, n));
        if (full(i)) wanted = 0;
        for (const Vertex j : last_drawn[i])
          failed[i] = neighbors[i].count(j) > 0 ? 0 : failed[i] + 1;
        last_drawn[i].clear();
        if (options.max_failed_samples > 0 && failed[i] >= options.max_failed_samples &&
            !neighbors[i].empty()) {
          wanted = 0;
        }
        std::vector<Vertex> list;
        for (Vertex j = 0; j < n; ++j) {
          if (j != i) list.push_back(j);
        }
        std::sort(list.begin(), list.end(), by_distance_to(i));
        for (const Vertex j : list) {
          if (wanted <= 0) break;
          if (tested.count(MakeVertexPair(i, j)) > 0) continue;
          --wanted;
          ++drawn[i];
          sampled.insert(MakeVertexPair(i, j));
          last_drawn[i].push_back(j);
        }
      }
      verify(sampled);
    }

    std::set<VertexPair> propagated;
    const auto propagate = [&](Vertex a, Vertex b) {
      if (full(a)) return;
      std::vector<Vertex> candidates;
      for (const Vertex c : neighbors[b]) {
        if (c != a && tested.count(MakeVertexPair(a, c)) == 0) candidates.push_back(c);
      }
      std::sort(candidates.begin(), candidates.end(), by_distance_to(a));
      for (std::size_t k = 0;
           k < std::min(candidates.size(), static_cast<std::size_t>(options.num_to_propagate));
           ++k) {
        propagated.insert(MakeVertexPair(a, candidates[k]));
      }
    };
    for (const auto& [a, b] : edges) {
      propagate(a, b);
      propagate(b, a);
    }
    verify(propagated);
    if (sampled.empty() && propagated.empty()) return batches;
  }
}

}  // namespace colmap_graphmatch
