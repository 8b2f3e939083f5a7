#include "colmap_graphmatch/geometry/inliers.h"

namespace colmap_graphmatch {

double SquaredError(ErrorKind kind, const Eigen::Matrix3d& m, const PointPair& pair) {
  const double a = m(0, 0) * pair.x1 + m(0, 1) * pair.y1 + m(0, 2);
  const double b = m(1, 0) * pair.x1 + m(1, 1) * pair.y1 + m(1, 2);
  const double c = m(2, 0) * pair.x1 + m(2, 1) * pair.y1 + m(2, 2);
  if (kind == ErrorKind::kHomography) {
    const double dx = pair.x2 - a / c;
    const double dy = pair.y2 - b / c;
    return dx * dx + dy * dy;
  }
  const double d = m(0, 0) * pair.x2 + m(1, 0) * pair.y2 + m(2, 0);
  const double e = m(0, 1) * pair.x2 + m(1, 1) * pair.y2 + m(2, 1);
  const double numerator = pair.x2 * a + pair.y2 * b + c;
  return numerator * numerator / (a * a + b * b + d * d + e * e);
}

std::vector<std::size_t> FindInliers(ErrorKind kind, const Eigen::Matrix3d& model,
                                     const std::vector<PointPair>& pairs, double max_error) {
  std::vector<std::size_t> inliers;
  const double max_squared_error = max_error * max_error;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (SquaredError(kind, model, pairs[i]) <= max_squared_error) inliers.push_back(i);
  }
  return inliers;
}

}  // namespace colmap_graphmatch
