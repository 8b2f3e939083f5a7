#pragma once

#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/database/features.h"

namespace colmap_graphmatch {

// num x 2, row-major.
std::vector<float> PositionsOf(const Keypoints& keypoints);

// Where the matches are, which must be among the positions.
std::vector<PointPair> PointsOf(const FeatureMatches& matches, const std::vector<float>& positions1,
                                const std::vector<float>& positions2);

}  // namespace colmap_graphmatch
