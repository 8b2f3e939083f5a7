#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

inline constexpr std::size_t kDim = 16;

// Places with photos taken on walks: photos of a place look like it (noise apart), and those near
// each other on the walk match.
struct Scene {
  std::vector<float> vectors;
  std::set<VertexPair> edges;
  std::size_t num_vertices = 0;
};

inline Scene MakeScene(int num_places, int photos_a_place, int reach, double noise,
                       std::uint64_t seed) {
  Random random({seed});
  const auto gauss = [&random] {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += random.Uniform();
    return sum;
  };
  Scene scene;
  for (int place = 0; place < num_places; ++place) {
    std::vector<double> center(kDim);
    for (double& value : center) value = gauss();
    const auto first = static_cast<Vertex>(scene.num_vertices);
    for (int photo = 0; photo < photos_a_place; ++photo) {
      std::vector<double> vector(kDim);
      double norm = 0;
      for (std::size_t d = 0; d < kDim; ++d) {
        vector[d] = center[d] + noise * gauss();
        norm += vector[d] * vector[d];
      }
      for (const double value : vector) {
        scene.vectors.push_back(static_cast<float>(value / std::sqrt(norm)));
      }
      for (int other = std::max(0, photo - reach); other < photo; ++other) {
        scene.edges.emplace(first + static_cast<Vertex>(other), first + static_cast<Vertex>(photo));
      }
      ++scene.num_vertices;
    }
  }
  return scene;
}

inline VectorRanking MakeRanking(const Scene& scene, std::size_t list_length = 512) {
  ThreadPool threads(2);
  RankingOptions options;
  options.list_length = list_length;
  return VectorRanking(options, scene.num_vertices, kDim, scene.vectors, threads);
}

// Not 0, 1, 2, ...: the loop must not take vertices for ids.
inline std::vector<ImageId> MakeIds(std::size_t num_vertices) {
  std::vector<ImageId> ids;
  for (std::size_t i = 0; i < num_vertices; ++i) ids.push_back(static_cast<ImageId>(7 + 3 * i));
  return ids;
}

inline std::set<ImagePair> ImageEdges(const Scene& scene, const std::vector<ImageId>& ids) {
  std::set<ImagePair> edges;
  for (const auto& [a, b] : scene.edges) edges.emplace(ids[a], ids[b]);
  return edges;
}

}  // namespace colmap_graphmatch
