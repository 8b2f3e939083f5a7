#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/encoding/matrix.h"

namespace colmap_graphmatch {

// max_num of the rows, uniformly without replacement, ascending; all if there are no more.
std::vector<std::size_t> SelectRandom(std::size_t num_rows, std::size_t max_num, Random random);

// num rows of 128-dimensional descriptors as COLMAP stores them (512 x, clipped to 255, one byte),
// back in the units of x.
RowMatrixXf DescriptorsToFloat(const std::uint8_t* descriptors, std::size_t num);

}  // namespace colmap_graphmatch
