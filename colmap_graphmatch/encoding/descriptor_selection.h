#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/encoding/matrix.h"

namespace colmap_graphmatch {

// Which descriptors of an image are encoded when it has more than max_num. Both return ascending
// rows, all of them if there are no more than max_num.

// The features of the largest scales; of equal ones the first. They cover the most pixels and are
// the ones found again from other distances. NaN counts as scale 0.
std::vector<std::size_t> SelectLargestScales(const std::vector<float>& scales, std::size_t max_num);

// Uniformly without replacement.
std::vector<std::size_t> SelectRandom(std::size_t num_rows, std::size_t max_num, Random random);

// num rows of 128-dimensional descriptors as COLMAP stores them (512 x, clipped to 255, one byte),
// back in the units of x.
RowMatrixXf DescriptorsToFloat(const std::uint8_t* descriptors, std::size_t num);

}  // namespace colmap_graphmatch
