#pragma once

#include <boost/pending/disjoint_sets.hpp>
#include <cstddef>
#include <vector>

#include "colmap_graphmatch/graph/matching_graph.h"

namespace colmap_graphmatch {

// Connected components of a graph that only grows, kept up to date edge by edge. A component has at
// least two vertices; vertices without an edge are isolated.
class Components {
 public:
  explicit Components(std::size_t num_vertices)
      : sets_(num_vertices), sizes_(num_vertices, 1), num_isolated_(num_vertices) {}

  void AddEdge(const VertexPair& edge) {
    const std::size_t a = sets_.find_set(edge.first);
    const std::size_t b = sets_.find_set(edge.second);
    if (a == b) return;
    const std::size_t size = sizes_[a] + sizes_[b];
    const std::size_t num_alone = (sizes_[a] == 1 ? 1U : 0U) + (sizes_[b] == 1 ? 1U : 0U);
    num_isolated_ -= num_alone;
    count_ = num_alone == 2 ? count_ + 1 : num_alone == 1 ? count_ : count_ - 1;
    sets_.link(a, b);
    sizes_[sets_.find_set(a)] = size;
    if (size > largest_) largest_ = size;
  }

  std::size_t Count() const { return count_; }
  std::size_t Largest() const { return largest_; }  // 0 while there is no edge.
  std::size_t NumIsolated() const { return num_isolated_; }

 private:
  boost::disjoint_sets_with_storage<> sets_;
  std::vector<std::size_t> sizes_;  // Valid at the representative of each set.
  std::size_t count_ = 0;
  std::size_t largest_ = 0;
  std::size_t num_isolated_;
};

}  // namespace colmap_graphmatch
