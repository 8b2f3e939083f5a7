#include "colmap_graphmatch/ranking/ranking.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "colmap_graphmatch/ranking/dot_products.h"
#include "colmap_graphmatch/ranking/nearest.h"

namespace colmap_graphmatch {
namespace {

// Vertices whose products with all others are computed at a time: the buffer is kBlockRows x N
// floats a thread.
constexpr std::size_t kBlockRows = 48;

}  // namespace

VectorRanking::VectorRanking(const RankingOptions& options, std::size_t num_vertices,
                             std::size_t dim, std::vector<float> vectors, ThreadPool& threads,
                             const StopRequest* stop)
    : num_vertices_(num_vertices),
      padded_dim_((dim + kRowPadding - 1) / kRowPadding * kRowPadding),
      lists_(num_vertices) {
  if (padded_dim_ == dim) {
    vectors_ = std::move(vectors);
  } else {
    vectors_.resize(num_vertices * padded_dim_);
    for (std::size_t i = 0; i < num_vertices; ++i) {
      std::copy_n(vectors.data() + i * dim, dim, vectors_.data() + i * padded_dim_);
    }
  }
  const std::size_t num_blocks = (num_vertices + kBlockRows - 1) / kBlockRows;
  threads.ParallelFor(num_blocks, [&](std::size_t block) {
    if (stop != nullptr) stop->ThrowIfRequested();
    const std::size_t first = block * kBlockRows;
    const std::size_t num_rows = std::min(kBlockRows, num_vertices_ - first);
    std::vector<float> products(num_rows * num_vertices_);
    DotProducts(Row(first), num_rows, Row(0), num_vertices_, padded_dim_, products.data(),
                num_vertices_);
    for (std::size_t i = 0; i < num_rows; ++i) {
      lists_[first + i] = Nearest(products.data() + i * num_vertices_, num_vertices_,
                                  static_cast<Vertex>(first + i), options.list_length);
    }
  });
}

float VectorRanking::Distance(Vertex a, Vertex b) const {
  float product = 0;
  DotProducts(Row(a), 1, Row(b), 1, padded_dim_, &product, 1);
  return 2 - 2 * product;
}

std::vector<Vertex> VectorRanking::AllOf(Vertex vertex) const {
  std::vector<float> products(num_vertices_);
  DotProducts(Row(vertex), 1, Row(0), num_vertices_, padded_dim_, products.data(), num_vertices_);
  return Nearest(products.data(), num_vertices_, vertex, num_vertices_);
}

}  // namespace colmap_graphmatch
