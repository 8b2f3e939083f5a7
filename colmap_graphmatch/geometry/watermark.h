#pragma once

#include <cstddef>
#include <vector>

#include "colmap_graphmatch/geometry/camera.h"
#include "colmap_graphmatch/geometry/point_pairs.h"

namespace colmap_graphmatch {

// COLMAP's ratios (src/colmap/estimators/two_view_geometry.h).
inline constexpr double kWatermarkBorder = 0.1;      // Of the image's diagonal.
inline constexpr double kMinWatermarkInliers = 0.7;  // Of the pair's inliers.

// Whether the inliers are but a mark that was printed on both images: most lie in the border of
// both, and one shift explains most, to within max_error pixels. matches: in pixels. Never where a
// camera has no size, e.g. since it is missing: where its border is, nobody knows. (To COLMAP all
// is border then.)
bool IsWatermark(const Camera& camera1, const Camera& camera2,
                 const std::vector<PointPair>& matches, const std::vector<std::size_t>& inliers,
                 double max_error);

}  // namespace colmap_graphmatch
