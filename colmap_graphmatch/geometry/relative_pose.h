#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "colmap_graphmatch/geometry/point_pairs.h"

namespace colmap_graphmatch {

// Where the second camera is: X2 = rotation X1 + translation (COLMAP's cam2_from_cam1).
struct RelativeMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  // COLMAP's column qvec: w, x, y, z.
  Eigen::Vector4d Quaternion() const {
    const Eigen::Quaterniond q(rotation);
    return {q.w(), q.x(), q.y(), q.z()};
  }
};

// The one of the four poses of an essential matrix (Hartley and Zisserman, 9.6.2) that has most of
// the inliers before both cameras, no further than 1,000 times the distance between them;
// translation of length 1. Nothing if no pose has any. pairs: on the normalised image planes.
std::optional<RelativeMotion> PoseOfEssential(const Eigen::Matrix3d& essential,
                                              const std::vector<PointPair>& pairs,
                                              const std::vector<std::size_t>& inliers);

}  // namespace colmap_graphmatch
