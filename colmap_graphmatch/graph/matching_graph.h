#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// Two different vertices, the smaller first.
using VertexPair = std::pair<Vertex, Vertex>;

inline VertexPair MakeVertexPair(Vertex a, Vertex b) {
  return a < b ? VertexPair(a, b) : VertexPair(b, a);
}

// What several tasks propose, as one list: ascending, each pair once.
std::vector<VertexPair> UniteProposals(const std::vector<std::vector<VertexPair>>& proposals);

struct TestedVertexPair {
  VertexPair pair;
  bool is_edge = false;
};

// The matching graph G and the set T of the tested pairs (GraphMatch, section 2). Const members are
// thread-safe.
class MatchingGraph {
 public:
  explicit MatchingGraph(std::size_t num_vertices);

  std::size_t NumVertices() const { return neighbors_.size(); }
  std::size_t NumEdges() const { return edges_.size(); }
  std::size_t NumTested() const { return num_tested_; }

  std::size_t Degree(Vertex vertex) const { return neighbors_[vertex].size(); }
  // Ascending.
  const std::vector<Vertex>& Neighbors(Vertex vertex) const { return neighbors_[vertex]; }
  bool IsTested(Vertex a, Vertex b) const;
  std::size_t NumTestedOf(Vertex vertex) const { return tested_[vertex].size(); }

  // The vertices that it was tested with, ascending.
  const std::vector<Vertex>& Tested(Vertex vertex) const { return tested_[vertex]; }

  // In the order in which they were added.
  const std::vector<VertexPair>& Edges() const { return edges_; }

  // Adds pairs, none of which may have been tested before, all different.
  void Add(const std::vector<TestedVertexPair>& pairs);

 private:
  std::vector<std::vector<Vertex>> neighbors_;  // Sorted.
  std::vector<std::vector<Vertex>> tested_;     // Sorted; both directions of every tested pair.
  std::vector<VertexPair> edges_;
  std::size_t num_tested_ = 0;
};

}  // namespace colmap_graphmatch
