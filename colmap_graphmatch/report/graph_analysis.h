#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace colmap_graphmatch {

// An edge of a finished matching graph; vertices are counted from 0.
struct GraphEdge {
  std::size_t a = 0;
  std::size_t b = 0;
  std::uint32_t num_inliers = 0;
};

// A vertex without which its component falls into parts.
struct ArticulationPoint {
  std::size_t vertex = 0;
  std::vector<std::size_t> parts;  // Numbers of vertices, the greatest first; at least two.
};

// An edge without which its component falls into two.
struct Bridge {
  std::size_t edge = 0;              // Its place in the list of edges.
  std::array<std::size_t, 2> sides;  // Numbers of vertices on the sides of a and b.
};

// Edges with few inliers that alone hold two groups together which stronger edges make.
struct WeakLink {
  std::array<std::size_t, 2> groups;  // Numbers of vertices, the greater first.
  std::vector<std::size_t> edges;     // Places in the list of edges.
};

// Vertices that edges connect, ascending: the largest component first, then by the first vertex.
// Vertices without an edge are left out.
std::vector<std::vector<std::size_t>> FindComponents(std::size_t num_vertices,
                                                     const std::vector<GraphEdge>& edges);

struct CutPlaces {
  std::vector<ArticulationPoint> articulation_points;  // By vertex.
  std::vector<Bridge> bridges;                         // By edge.
};

// In O(vertices + edges). No two edges may join the same vertices.
CutPlaces FindCutPlaces(std::size_t num_vertices, const std::vector<GraphEdge>& edges);

// Groups are what edges with at least strong_num_inliers hold together, of at least min_group_size
// vertices. Pairs of groups with the smaller group greatest first.
std::vector<WeakLink> FindWeakLinks(std::size_t num_vertices, const std::vector<GraphEdge>& edges,
                                    std::uint32_t strong_num_inliers, std::size_t min_group_size);

}  // namespace colmap_graphmatch
