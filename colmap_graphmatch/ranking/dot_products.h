#pragma once

#include <cstddef>

namespace colmap_graphmatch {

// Rows are padded with zeros to a multiple of this many floats, the longest vector of any target.
inline constexpr std::size_t kRowPadding = 16;

// products[i * products_stride + j] = a_i . b_j for num_a x num_b rows of `dim` floats (a multiple
// of kRowPadding), row-major and contiguous. Uses the widest vector instructions of the processor
// it runs on.
//
// Every product is summed in the same order whatever the numbers of rows, so that a product
// computed alone equals, bit for bit, the one computed in a block, and a_i . b_j equals b_j . a_i.
void DotProducts(const float* a, std::size_t num_a, const float* b, std::size_t num_b,
                 std::size_t dim, float* products, std::size_t products_stride);

}  // namespace colmap_graphmatch
