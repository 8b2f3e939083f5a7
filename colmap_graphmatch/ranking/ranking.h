#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

struct RankingOptions {
  // The length of the ranked list that is kept for every image; what the loop needs beyond it is
  // computed again. Memory: 4 N list_length bytes.
  std::size_t list_length = 512;
};

// For every image the others, those that look most alike first. Const members are thread-safe.
class Ranking {
 public:
  virtual ~Ranking() = default;

  virtual std::size_t NumVertices() const = 0;

  // How different two images look; smaller is nearer.
  virtual float Distance(Vertex a, Vertex b) const = 0;

  // The nearest others, nearest first: as many as are kept.
  virtual const std::vector<Vertex>& NearestOf(Vertex vertex) const = 0;

  // All others that are ranked, nearest first; NearestOf(vertex) is its beginning. May take O(N) on
  // every call.
  virtual std::vector<Vertex> AllOf(Vertex vertex) const = 0;
};

// By ascending distance d = |x - y|^2 = 2 - 2 x.y of the images' unit-length vectors (GraphMatch,
// section 3.1), ties by ascending number. Computed by blocked matrix products, never as an N x N
// matrix. Results are bitwise the same for any number of threads, and lists agree with distances
// computed one by one.
class VectorRanking : public Ranking {
 public:
  // vectors: N rows of dim floats of unit length, row-major. Throws StoppedError if stop (may be
  // null) asks for it.
  VectorRanking(const RankingOptions& options, std::size_t num_vertices, std::size_t dim,
                std::vector<float> vectors, ThreadPool& threads, const StopRequest* stop = nullptr);

  std::size_t NumVertices() const override { return num_vertices_; }

  // In [0, 4], up to rounding.
  float Distance(Vertex a, Vertex b) const override;

  // At most list_length.
  const std::vector<Vertex>& NearestOf(Vertex vertex) const override { return lists_[vertex]; }

  // Computed on every call: O(N dim).
  std::vector<Vertex> AllOf(Vertex vertex) const override;

 private:
  const float* Row(std::size_t row) const { return vectors_.data() + row * padded_dim_; }

  std::size_t num_vertices_;
  std::size_t padded_dim_;
  std::vector<float> vectors_;  // N x padded_dim_, padded with zeros.
  std::vector<std::vector<Vertex>> lists_;
};

}  // namespace colmap_graphmatch
