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
  std::map<Vertex, std::size_t> places;
  std::map<Vertex, std::vector<Vertex>> last_drawn;
  std::map<Vertex, int> failed;
  std::vector<std::set<VertexPair>> batches;
  std::size_t first_new_edge = 0;
  bool sampling_over = false;

  const auto full = [&](Vertex v) {
    return neighbors[v].size() >= static_cast<std::size_t>(options.max_num_neighbors);
  };
  const auto verify = [&](const std::set<VertexPair>& pairs) {
    std::size_t found = 0;
    for (const VertexPair& pair : pairs) {
      tested.insert(pair);
      if (truth.count(pair) == 0) continue;
      neighbors[pair.first].insert(pair.second);
      neighbors[pair.second].insert(pair.first);
      edges.push_back(pair);
      ++found;
    }
    if (!pairs.empty()) batches.push_back(pairs);
    return found;
  };

  for (int iteration = 0;; ++iteration) {
    std::set<VertexPair> sampled;
    if (iteration < options.number_sample_iterations && !sampling_over) {
      std::map<Vertex, int> charged;
      std::set<VertexPair> counted;
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
        std::size_t& place = places[i];
        for (std::size_t k = options.sample_untested_only ? 0 : place; k < list.size(); ++k) {
          if (wanted <= 0) break;
          const Vertex j = list[k];
          const bool is_tested = tested.count(MakeVertexPair(i, j)) > 0;
          if (!options.sample_untested_only) {
            ++place;
            --wanted;
            if (!options.count_incoming_tests) ++charged[i];
            if (is_tested) continue;
            sampled.insert(MakeVertexPair(i, j));
            last_drawn[i].push_back(j);
            continue;
          }
          if (is_tested) continue;
          --wanted;
          sampled.insert(MakeVertexPair(i, j));
          last_drawn[i].push_back(j);
          if (!options.count_incoming_tests) ++charged[i];
        }
      }
      if (options.count_incoming_tests) {
        for (const auto& [a, b] : sampled) {
          ++charged[a];
          ++charged[b];
        }
      }
      for (const auto& [vertex, count] : charged) drawn[vertex] += count;
      const std::size_t found = verify(sampled);
      sampling_over = options.stop_sampling_without_edges && found == 0;
    }

    std::set<VertexPair> propagated;
    const auto propagate = [&](Vertex a, Vertex b) {
      if (full(a)) return;
      std::vector<Vertex> candidates;
      for (const Vertex c : neighbors[b]) {
        if (c == a) continue;
        if (options.propagate_untested_only && tested.count(MakeVertexPair(a, c)) > 0) continue;
        candidates.push_back(c);
      }
      const bool source =
          options.propagation_distance == GraphMatchOptions::PropagationDistance::kSource;
      std::sort(candidates.begin(), candidates.end(), by_distance_to(source ? a : b));
      for (std::size_t k = 0;
           k < std::min(candidates.size(), static_cast<std::size_t>(options.num_to_propagate));
           ++k) {
        const VertexPair pair = MakeVertexPair(a, candidates[k]);
        if (tested.count(pair) == 0) propagated.insert(pair);
      }
    };
    const std::size_t num_edges = edges.size();
    for (std::size_t e = options.propagate_from_new_edges_only ? first_new_edge : 0; e < num_edges;
         ++e) {
      propagate(edges[e].first, edges[e].second);
      propagate(edges[e].second, edges[e].first);
    }
    first_new_edge = num_edges;
    verify(propagated);
    bool more = false;
    for (int later = iteration + 1; later < options.number_sample_iterations; ++later) {
      const bool none_now =
          !options.sample_untested_only || options.TestsInIteration(iteration, n) == 0;
      more = more || (none_now && !sampling_over && options.TestsInIteration(later, n) > 0);
    }
    if (sampled.empty() && propagated.empty() && !more) return batches;
  }
}

}  // namespace colmap_graphmatch
