#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/graph/matching_graph.h"

namespace colmap_graphmatch {

// Which features of an image are inliers in which of its edges. Two images A and C share tracks
// through a common neighbour B: the features of B that are inliers both in A-B and in B-C, points
// that all three see. Const members are thread-safe.
//
// Memory: a bit for each feature of both images of an edge.
class SharedTracks {
 public:
  using Features = std::vector<std::uint64_t>;  // A bit each, from the lowest of the first word.

  explicit SharedTracks(std::size_t num_vertices) : edges_(num_vertices) {}

  // Adds an edge, once; in any order. inliers: feature1 is of pair.first.
  void Add(const VertexPair& pair, const FeatureMatches& inliers);

  // The features of the vertex that are inliers with a neighbour: none if that edge is not here.
  const Features& Inliers(Vertex vertex, Vertex neighbor) const;

  static std::size_t CountShared(const Features& a, const Features& b);

 private:
  void AddDirected(Vertex from, Vertex to, Features features);

  // By vertex: its neighbours, ascending, and its features that are inliers with each.
  std::vector<std::vector<std::pair<Vertex, Features>>> edges_;
};

}  // namespace colmap_graphmatch
