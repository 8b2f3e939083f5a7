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
// Memory: a bit for each feature of both images of an edge. What is shared through an image costs
// one pass over these bits, however many edges a feature is an inlier in.
class SharedTracks {
 public:
  explicit SharedTracks(std::size_t num_vertices) : edges_(num_vertices) {}

  // Adds an edge, once; in any order. inliers: feature1 is of pair.first.
  void Add(const VertexPair& pair, const FeatureMatches& inliers);

  // Calls visit(c, number of tracks) for every edge (b, c) in which features of b are inliers that
  // are inliers in (a, b), too. Nothing if (a, b) is not here.
  template <typename Visit>
  void VisitThrough(Vertex a, Vertex b, const Visit& visit) const {
    const Features* of_a = Find(b, a);
    if (of_a == nullptr) return;
    for (const auto& [c, features] : edges_[b]) {
      if (c == a) continue;
      const std::size_t num_shared = CountShared(*of_a, features);
      if (num_shared > 0) visit(c, num_shared);
    }
  }

 private:
  using Features = std::vector<std::uint64_t>;  // A bit each.

  static std::size_t CountShared(const Features& a, const Features& b);
  void AddDirected(Vertex from, Vertex to, Features features);
  const Features* Find(Vertex vertex, Vertex neighbor) const;

  // By vertex: its neighbours, ascending, and its features that are inliers with each.
  std::vector<std::vector<std::pair<Vertex, Features>>> edges_;
};

}  // namespace colmap_graphmatch
