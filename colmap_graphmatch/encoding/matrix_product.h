#pragma once

#include <cstddef>

namespace colmap_graphmatch {

// Numbers of columns of the second factor are padded to a multiple of this, the longest vector of
// any processor.
inline constexpr std::size_t kColumnPadding = 16;

// A matrix in memory: element (i, j) is data[i * row_stride + j * col_stride].
struct MatrixView {
  const float* data;
  std::size_t row_stride;
  std::size_t col_stride;
};

// c = a b for a (rows x inner, any strides), b (inner x cols, row-major without gaps) and c (rows x
// cols, row-major without gaps); cols is a multiple of kColumnPadding. Made for thin products, rows
// or cols being the components of a mixture. Uses the widest vector instructions of the processor
// it runs on; sums every element of c in the order of the inner index.
void MatrixProduct(const MatrixView& a, const float* b, std::size_t rows, std::size_t inner,
                   std::size_t cols, float* c);

}  // namespace colmap_graphmatch
