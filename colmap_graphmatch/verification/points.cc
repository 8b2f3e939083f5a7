#include "colmap_graphmatch/verification/points.h"

#include <cstddef>

namespace colmap_graphmatch {

std::vector<float> PositionsOf(const Keypoints& keypoints) {
  std::vector<float> positions;
  positions.reserve(2 * keypoints.num_rows);
  for (std::size_t row = 0; row < keypoints.num_rows; ++row) {
    const float* keypoint = keypoints.data.data() + row * keypoints.num_cols;
    positions.insert(positions.end(), keypoint, keypoint + 2);
  }
  return positions;
}

std::vector<PointPair> PointsOf(const FeatureMatches& matches, const std::vector<float>& positions1,
                                const std::vector<float>& positions2) {
  std::vector<PointPair> points;
  points.reserve(matches.size());
  for (const FeatureMatch& match : matches) {
    const float* const first = positions1.data() + 2 * std::size_t{match.feature1};
    const float* const second = positions2.data() + 2 * std::size_t{match.feature2};
    points.push_back({first[0], first[1], second[0], second[1]});
  }
  return points;
}

}  // namespace colmap_graphmatch
