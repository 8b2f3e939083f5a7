#include "colmap_graphmatch/geometry/relative_pose.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <limits>

namespace colmap_graphmatch {
namespace {

// Whether the point that both rays see is before both cameras. Its depths d1 and d2 fulfil
// d1 R x1 + t = d2 x2.
bool IsBeforeBoth(const RelativeMotion& pose, const PointPair& pair) {
  constexpr double kMaxDepth = 1000;
  constexpr double kMinDepth = std::numeric_limits<double>::epsilon();
  const Eigen::Vector3d a = pose.rotation * Eigen::Vector3d(pair.x1, pair.y1, 1);
  const Eigen::Vector3d b(pair.x2, pair.y2, 1);
  const Eigen::Vector3d normal = a.cross(b);
  const double square = normal.squaredNorm();
  const double depth1 = pose.translation.cross(b).dot(-normal) / square;
  const double depth2 = pose.translation.cross(a).dot(-normal) / square;
  return depth1 > kMinDepth && depth1 < kMaxDepth && depth2 > kMinDepth && depth2 < kMaxDepth;
}

}  // namespace

std::optional<RelativeMotion> PoseOfEssential(const Eigen::Matrix3d& essential,
                                              const std::vector<PointPair>& pairs,
                                              const std::vector<std::size_t>& inliers) {
  if (!essential.allFinite()) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  Eigen::Matrix3d v = svd.matrixV();
  if (u.determinant() < 0) u.col(2) *= -1;
  if (v.determinant() < 0) v.col(2) *= -1;
  Eigen::Matrix3d turn;
  turn << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  std::optional<RelativeMotion> best;
  std::size_t best_count = 0;
  for (const bool turned_back : {false, true}) {
    for (const double sign : {1.0, -1.0}) {
      RelativeMotion pose;
      if (turned_back) {
        pose.rotation = u * turn.transpose() * v.transpose();
      } else {
        pose.rotation = u * turn * v.transpose();
      }
      pose.translation = sign * u.col(2);
      std::size_t count = 0;
      for (const std::size_t i : inliers) {
        if (IsBeforeBoth(pose, pairs[i])) ++count;
      }
      if (count > best_count) {
        best_count = count;
        best = pose;
      }
    }
  }
  return best;
}

}  // namespace colmap_graphmatch
