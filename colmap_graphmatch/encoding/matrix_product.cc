#include "colmap_graphmatch/encoding/matrix_product.h"

// Highway compiles this file once for each instruction set and picks one when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "colmap_graphmatch/encoding/matrix_product.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace colmap_graphmatch {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Rows of the register tile. With two vectors a row, 12 accumulators hide the latency of a
// multiply-add on two units and leave room for the operands in 16 registers.
constexpr std::size_t kTileRows = 6;

template <std::size_t kRows, std::size_t kVectors>
void ProductTile(const MatrixView& a, const float* HWY_RESTRICT b, std::size_t inner,
                 std::size_t cols, float* HWY_RESTRICT c) {
  const hn::CappedTag<float, kColumnPadding> tag;
  const std::size_t lanes = hn::Lanes(tag);
  using Vector = hn::Vec<decltype(tag)>;
  Vector sums[kRows][kVectors];
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t v = 0; v < kVectors; ++v) sums[i][v] = hn::Zero(tag);
  }
  for (std::size_t k = 0; k < inner; ++k) {
    Vector row[kVectors];
    for (std::size_t v = 0; v < kVectors; ++v) row[v] = hn::LoadU(tag, b + k * cols + v * lanes);
    for (std::size_t i = 0; i < kRows; ++i) {
      const Vector factor = hn::Set(tag, a.data[i * a.row_stride + k * a.col_stride]);
      for (std::size_t v = 0; v < kVectors; ++v) {
        sums[i][v] = hn::MulAdd(factor, row[v], sums[i][v]);
      }
    }
  }
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t v = 0; v < kVectors; ++v)
      hn::StoreU(sums[i][v], tag, c + i * cols + v * lanes);
  }
}

template <std::size_t kRows>
void ProductRows(const MatrixView& a, const float* b, std::size_t inner, std::size_t cols,
                 float* c) {
  const std::size_t lanes = hn::Lanes(hn::CappedTag<float, kColumnPadding>());
  std::size_t j = 0;
  for (; j + 2 * lanes <= cols; j += 2 * lanes) ProductTile<kRows, 2>(a, b + j, inner, cols, c + j);
  for (; j < cols; j += lanes) ProductTile<kRows, 1>(a, b + j, inner, cols, c + j);
}

void MatrixProductOnTarget(const MatrixView& a, const float* b, std::size_t rows, std::size_t inner,
                           std::size_t cols, float* c) {
  std::size_t i = 0;
  const auto row = [&](std::size_t first) {
    return MatrixView{a.data + first * a.row_stride, a.row_stride, a.col_stride};
  };
  for (; i + kTileRows <= rows; i += kTileRows) {
    ProductRows<kTileRows>(row(i), b, inner, cols, c + i * cols);
  }
  for (; i < rows; ++i) ProductRows<1>(row(i), b, inner, cols, c + i * cols);
}

}  // namespace HWY_NAMESPACE
}  // namespace colmap_graphmatch
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colmap_graphmatch {

HWY_EXPORT(MatrixProductOnTarget);

void MatrixProduct(const MatrixView& a, const float* b, std::size_t rows, std::size_t inner,
                   std::size_t cols, float* c) {
  HWY_DYNAMIC_DISPATCH(MatrixProductOnTarget)(a, b, rows, inner, cols, c);
}

}  // namespace colmap_graphmatch
#endif
