#include "colmap_graphmatch/report/graph_analysis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>
#include <utility>

#include "colmap_graphmatch/base/random.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<GraphEdge> Edges(const std::vector<std::pair<std::size_t, std::size_t>>& pairs,
                             std::uint32_t num_inliers = 100) {
  std::vector<GraphEdge> edges;
  for (const auto& [a, b] : pairs) edges.push_back({a, b, num_inliers});
  return edges;
}

// The sizes of the parts that are left of the component of `start`, by plain search, without a
// vertex and without an edge (num_vertices, edges.size(): without none).
std::vector<std::size_t> PartsWithout(std::size_t num_vertices, const std::vector<GraphEdge>& edges,
                                      std::size_t without_vertex, std::size_t without_edge,
                                      const std::vector<std::size_t>& starts) {
  std::set<std::size_t> seen;
  std::vector<std::size_t> parts;
  for (const std::size_t start : starts) {
    if (start == without_vertex || seen.count(start) > 0) continue;
    const std::size_t before = seen.size();
    std::vector<std::size_t> open = {start};
    seen.insert(start);
    while (!open.empty()) {
      const std::size_t vertex = open.back();
      open.pop_back();
      for (std::size_t i = 0; i < edges.size(); ++i) {
        if (i == without_edge) continue;
        for (const auto& [a, b] :
             {std::make_pair(edges[i].a, edges[i].b), std::make_pair(edges[i].b, edges[i].a)}) {
          if (a != vertex || b == without_vertex || !seen.insert(b).second) continue;
          open.push_back(b);
        }
      }
    }
    parts.push_back(seen.size() - before);
  }
  EXPECT_LE(seen.size(), num_vertices);
  return parts;
}

TEST(Components, LargestFirstAndNoLonelyVertices) {
  EXPECT_THAT(FindComponents(8, Edges({{1, 2}, {4, 6}, {6, 7}, {3, 0}})),
              ElementsAre(ElementsAre(4, 6, 7), ElementsAre(0, 3), ElementsAre(1, 2)));
  EXPECT_THAT(FindComponents(3, {}), IsEmpty());
  EXPECT_THAT(FindComponents(0, {}), IsEmpty());
}

TEST(CutPlaces, TwoTrianglesOnOneEdge) {
  const CutPlaces places =
      FindCutPlaces(7, Edges({{0, 1}, {0, 2}, {1, 2}, {2, 3}, {3, 4}, {3, 5}, {4, 5}}));
  ASSERT_THAT(places.bridges, SizeIs(1));
  EXPECT_EQ(places.bridges[0].edge, 3U);
  EXPECT_THAT(places.bridges[0].sides, ElementsAre(3, 3));
  ASSERT_THAT(places.articulation_points, SizeIs(2));
  EXPECT_EQ(places.articulation_points[0].vertex, 2U);
  EXPECT_THAT(places.articulation_points[0].parts, ElementsAre(3, 2));
  EXPECT_EQ(places.articulation_points[1].vertex, 3U);
}

TEST(CutPlaces, AStarAndNothing) {
  const CutPlaces star = FindCutPlaces(4, Edges({{0, 3}, {1, 3}, {2, 3}}));
  ASSERT_THAT(star.articulation_points, SizeIs(1));
  EXPECT_THAT(star.articulation_points[0].parts, ElementsAre(1, 1, 1));
  ASSERT_THAT(star.bridges, SizeIs(3));
  for (const Bridge& bridge : star.bridges) EXPECT_THAT(bridge.sides, ElementsAre(1, 3));
  EXPECT_THAT(FindCutPlaces(3, {}).bridges, IsEmpty());
}

// As long as a collection: nothing here may need stack for every image.
TEST(CutPlaces, AChainOfManyPhotos) {
  constexpr std::size_t kNum = 100000;
  std::vector<GraphEdge> edges;
  for (std::size_t i = 0; i + 1 < kNum; ++i) edges.push_back({i, i + 1, 50});
  const CutPlaces places = FindCutPlaces(kNum, edges);
  EXPECT_EQ(places.bridges.size(), kNum - 1);
  EXPECT_EQ(places.articulation_points.size(), kNum - 2);
  EXPECT_THAT(places.bridges[9].sides, ElementsAre(10, kNum - 10));
}

TEST(CutPlaces, AreThoseThatRemovalShows) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random({seed});
    const std::size_t num_vertices = 2 + random.Index(14);
    std::vector<GraphEdge> edges;
    for (std::size_t a = 0; a < num_vertices; ++a) {
      for (std::size_t b = a + 1; b < num_vertices; ++b) {
        if (random.Index(num_vertices) < 2) edges.push_back({a, b, 20});
      }
    }
    const CutPlaces places = FindCutPlaces(num_vertices, edges);
    auto point = places.articulation_points.begin();
    for (std::size_t vertex = 0; vertex < num_vertices; ++vertex) {
      std::vector<std::size_t> neighbors;
      for (const GraphEdge& edge : edges) {
        if (edge.a == vertex) neighbors.push_back(edge.b);
        if (edge.b == vertex) neighbors.push_back(edge.a);
      }
      std::vector<std::size_t> parts =
          PartsWithout(num_vertices, edges, vertex, edges.size(), neighbors);
      if (parts.size() < 2) continue;
      std::sort(parts.begin(), parts.end(), std::greater<>());
      ASSERT_TRUE(point != places.articulation_points.end()) << "seed " << seed;
      EXPECT_EQ(point->vertex, vertex) << "seed " << seed;
      EXPECT_EQ(point->parts, parts) << "seed " << seed;
      ++point;
    }
    EXPECT_TRUE(point == places.articulation_points.end()) << "seed " << seed;
    auto bridge = places.bridges.begin();
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const std::vector<std::size_t> parts =
          PartsWithout(num_vertices, edges, num_vertices, i, {edges[i].a, edges[i].b});
      if (parts.size() < 2) continue;
      ASSERT_TRUE(bridge != places.bridges.end()) << "seed " << seed;
      EXPECT_EQ(bridge->edge, i) << "seed " << seed;
      EXPECT_THAT(bridge->sides, ElementsAre(parts[0], parts[1])) << "seed " << seed;
      ++bridge;
    }
    EXPECT_TRUE(bridge == places.bridges.end()) << "seed " << seed;
  }
}

TEST(WeakLinks, JoinGroupsThatAreStrongWithoutThem) {
  std::vector<GraphEdge> edges = Edges({{0, 1}, {1, 2}, {3, 4}, {4, 5}, {5, 6}, {7, 8}});
  edges.push_back({2, 3, 20});
  edges.push_back({0, 6, 16});
  edges.push_back({0, 2, 17});  // Within a group.
  edges.push_back({2, 7, 15});  // To a group that is too small.
  const std::vector<WeakLink> links = FindWeakLinks(9, edges, 30, 3);
  ASSERT_THAT(links, SizeIs(1));
  EXPECT_THAT(links[0].groups, ElementsAre(4, 3));
  EXPECT_THAT(links[0].edges, ElementsAre(6, 7));
  EXPECT_THAT(FindWeakLinks(9, edges, 20, 3), SizeIs(0));
  EXPECT_THAT(FindWeakLinks(9, edges, 30, 2), SizeIs(2));
}

}  // namespace
}  // namespace colmap_graphmatch
