#include "colmap_graphmatch/base/two_view_geometry.h"

#include <algorithm>

namespace colmap_graphmatch {

bool IsEdge(std::size_t num_inliers, int configuration, std::size_t min_num_inliers) {
  return num_inliers >= std::max<std::size_t>(1, min_num_inliers) &&
         configuration > static_cast<int>(TwoViewConfiguration::kDegenerate) &&
         configuration != static_cast<int>(TwoViewConfiguration::kWatermark);
}

}  // namespace colmap_graphmatch
