#include "colmap_graphmatch/ranking/dot_products.h"

#include <algorithm>

// Highway compiles this file once for each instruction set and picks one when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "colmap_graphmatch/ranking/dot_products.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace colmap_graphmatch {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Rows of the register tile: 12 accumulators hide the latency of a multiply-add on two units and
// leave room for the operands in 16 registers.
constexpr std::size_t kTileA = 4;
constexpr std::size_t kTileB = 3;

// Rows a block and columns a slice: a slice of both blocks (2 x 48 x 2 KB) stays in the
// second-level cache.
constexpr std::size_t kBlockRows = 48;
constexpr std::size_t kSlice = 512;

// products += a . b over one slice, for a tile of kA x kB products.
template <std::size_t kA, std::size_t kB>
void AddTile(const float* HWY_RESTRICT a, const float* HWY_RESTRICT b, std::size_t dim,
             std::size_t slice, float* HWY_RESTRICT products, std::size_t products_stride) {
  const hn::ScalableTag<float> tag;
  const std::size_t lanes = hn::Lanes(tag);
  using Vector = hn::Vec<decltype(tag)>;
  Vector sums[kA][kB];
  for (std::size_t i = 0; i < kA; ++i) {
    for (std::size_t j = 0; j < kB; ++j) sums[i][j] = hn::Zero(tag);
  }
  for (std::size_t d = 0; d < slice; d += lanes) {
    Vector bs[kB];
    for (std::size_t j = 0; j < kB; ++j) bs[j] = hn::LoadU(tag, b + j * dim + d);
    for (std::size_t i = 0; i < kA; ++i) {
      const Vector ai = hn::LoadU(tag, a + i * dim + d);
      for (std::size_t j = 0; j < kB; ++j) sums[i][j] = hn::MulAdd(ai, bs[j], sums[i][j]);
    }
  }
  for (std::size_t i = 0; i < kA; ++i) {
    for (std::size_t j = 0; j < kB; ++j) {
      products[i * products_stride + j] += hn::GetLane(hn::SumOfLanes(tag, sums[i][j]));
    }
  }
}

template <std::size_t kA>
void AddRows(const float* a, const float* b, std::size_t num_b, std::size_t dim, std::size_t slice,
             float* products, std::size_t products_stride) {
  std::size_t j = 0;
  for (; j + kTileB <= num_b; j += kTileB) {
    AddTile<kA, kTileB>(a, b + j * dim, dim, slice, products + j, products_stride);
  }
  for (; j < num_b; ++j) {
    AddTile<kA, 1>(a, b + j * dim, dim, slice, products + j, products_stride);
  }
}

void DotProductsOnTarget(const float* a, std::size_t num_a, const float* b, std::size_t num_b,
                         std::size_t dim, float* products, std::size_t products_stride) {
  for (std::size_t i = 0; i < num_a; ++i) {
    std::fill_n(products + i * products_stride, num_b, 0.0F);
  }
  for (std::size_t block_b = 0; block_b < num_b; block_b += kBlockRows) {
    const std::size_t rows_b = std::min(kBlockRows, num_b - block_b);
    for (std::size_t block_a = 0; block_a < num_a; block_a += kBlockRows) {
      const std::size_t end_a = std::min(block_a + kBlockRows, num_a);
      for (std::size_t d = 0; d < dim; d += kSlice) {
        const std::size_t slice = std::min(kSlice, dim - d);
        const float* slice_b = b + block_b * dim + d;
        std::size_t i = block_a;
        for (; i + kTileA <= end_a; i += kTileA) {
          AddRows<kTileA>(a + i * dim + d, slice_b, rows_b, dim, slice,
                          products + i * products_stride + block_b, products_stride);
        }
        for (; i < end_a; ++i) {
          AddRows<1>(a + i * dim + d, slice_b, rows_b, dim, slice,
                     products + i * products_stride + block_b, products_stride);
        }
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace colmap_graphmatch
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colmap_graphmatch {

HWY_EXPORT(DotProductsOnTarget);

void DotProducts(const float* a, std::size_t num_a, const float* b, std::size_t num_b,
                 std::size_t dim, float* products, std::size_t products_stride) {
  HWY_DYNAMIC_DISPATCH(DotProductsOnTarget)(a, num_a, b, num_b, dim, products, products_stride);
}

}  // namespace colmap_graphmatch
#endif
