#pragma once

#include <cstddef>
#include <vector>

namespace colmap_graphmatch {

// The max_num features of the largest scales, by ascending row; all if there are no more. Of equal
// ones the first. They cover the most pixels and are the ones found again from other distances. NaN
// counts as scale 0.
std::vector<std::size_t> SelectLargestScales(const std::vector<float>& scales, std::size_t max_num);

}  // namespace colmap_graphmatch
