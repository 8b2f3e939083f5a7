#pragma once

#include <cstddef>
#include <vector>

#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// The num_nearest others of `vertex`, or all, given the nearness of each of num_vertices to it:
// greatest first, ties by ascending number.
std::vector<Vertex> Nearest(const float* nearness, std::size_t num_vertices, Vertex vertex,
                            std::size_t num_nearest);

}  // namespace colmap_graphmatch
