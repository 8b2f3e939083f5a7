#include "colmap_graphmatch/ranking/dot_products.h"

#include <algorithm>

// Highway compiles this file once for each instruction set and picks one when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "colmap_graphmatch/ranking/dot_products.cc"
#include <hwy/aligned_allocator.h>
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

// Rows a block and columns a slice: a slice of both blocks (2 x 48 x 4 KB) stays in the
// second-level cache.
constexpr std::size_t kBlockRows = 48;
constexpr std::size_t kSlice = 1024;

// Rows from which on slices are packed. Rows of 4,096 floats begin at the same place of a page:
// unpacked, they would all fall into the same few sets of the caches.
constexpr std::size_t kRowsToPack = 12;

// A slice of some rows, and how far apart they are.
struct Slice {
  const float* begin;
  std::size_t stride;
};

// The slice itself, or a copy of it, row after row, if it is used often enough. buffer: room for
// kBlockRows x kSlice, or null: no copy.
Slice Pack(const float* rows, std::size_t num_rows, std::size_t dim, std::size_t slice,
           float* buffer) {
  if (buffer == nullptr) return {rows, dim};
  for (std::size_t i = 0; i < num_rows; ++i) {
    std::copy_n(rows + i * dim, slice, buffer + i * slice);
  }
  return {buffer, slice};
}

// Has the compiler load a vector once. GCC would rather load it again with every multiply-add,
// which then wait for the one load a cycle.
template <class V>
HWY_INLINE void KeepInRegister([[maybe_unused]] V& vector) {
#if HWY_ARCH_X86
  asm("" : "+v"(vector.raw));
#endif
}

// products += a . b over one slice, for a tile of kA x kB products.
template <std::size_t kA, std::size_t kB>
void AddTile(const Slice& slice_a, const Slice& slice_b, std::size_t slice,
             float* HWY_RESTRICT products, std::size_t products_stride) {
  const float* HWY_RESTRICT a = slice_a.begin;
  const float* HWY_RESTRICT b = slice_b.begin;
  const hn::ScalableTag<float> tag;
  const std::size_t lanes = hn::Lanes(tag);
  using Vector = hn::Vec<decltype(tag)>;
  Vector sums[kA][kB];
  for (std::size_t i = 0; i < kA; ++i) {
    for (std::size_t j = 0; j < kB; ++j) sums[i][j] = hn::Zero(tag);
  }
  for (std::size_t d = 0; d < slice; d += lanes) {
    Vector bs[kB];
    for (std::size_t j = 0; j < kB; ++j) bs[j] = hn::LoadU(tag, b + j * slice_b.stride + d);
    for (std::size_t i = 0; i < kA; ++i) {
      Vector ai = hn::LoadU(tag, a + i * slice_a.stride + d);
      KeepInRegister(ai);
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
void AddRows(const Slice& a, const Slice& b, std::size_t num_b, std::size_t slice, float* products,
             std::size_t products_stride) {
  std::size_t j = 0;
  const auto from_row = [&] { return Slice{b.begin + j * b.stride, b.stride}; };
  for (; j + kTileB <= num_b; j += kTileB) {
    AddTile<kA, kTileB>(a, from_row(), slice, products + j, products_stride);
  }
  for (; j < num_b; ++j) AddTile<kA, 1>(a, from_row(), slice, products + j, products_stride);
}

void DotProductsOnTarget(const float* a, std::size_t num_a, const float* b, std::size_t num_b,
                         std::size_t dim, float* products, std::size_t products_stride) {
  for (std::size_t i = 0; i < num_a; ++i) {
    std::fill_n(products + i * products_stride, num_b, 0.0F);
  }
  const bool packs = num_a >= kRowsToPack && num_b >= kRowsToPack;
  const hwy::AlignedFreeUniquePtr<float[]> buffer =
      packs ? hwy::AllocateAligned<float>(2 * kBlockRows * kSlice) : nullptr;
  float* const buffer_a = buffer.get();
  float* const buffer_b = packs ? buffer.get() + kBlockRows * kSlice : nullptr;
  for (std::size_t block_b = 0; block_b < num_b; block_b += kBlockRows) {
    const std::size_t rows_b = std::min(kBlockRows, num_b - block_b);
    for (std::size_t block_a = 0; block_a < num_a; block_a += kBlockRows) {
      const std::size_t end_a = std::min(block_a + kBlockRows, num_a);
      for (std::size_t d = 0; d < dim; d += kSlice) {
        const std::size_t slice = std::min(kSlice, dim - d);
        const Slice slice_a = Pack(a + block_a * dim + d, end_a - block_a, dim, slice, buffer_a);
        const Slice slice_b = Pack(b + block_b * dim + d, rows_b, dim, slice, buffer_b);
        std::size_t i = block_a;
        const auto from_row = [&] {
          return Slice{slice_a.begin + (i - block_a) * slice_a.stride, slice_a.stride};
        };
        for (; i + kTileA <= end_a; i += kTileA) {
          AddRows<kTileA>(from_row(), slice_b, rows_b, slice,
                          products + i * products_stride + block_b, products_stride);
        }
        for (; i < end_a; ++i) {
          AddRows<1>(from_row(), slice_b, rows_b, slice, products + i * products_stride + block_b,
                     products_stride);
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
