#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/geometry/point_pairs.h"

namespace colmap_graphmatch {

enum class SyntheticScene {
  kGeneral,
  kPlane,
  kRotation,     // The camera turns on the spot.
  kTranslation,  // It moves aside and does not turn.
  kForward,      // It moves along its axis.
};

// Matches of two images of 1000 x 800 pixels, both of focal length 900, of points that both see;
// noise of some pixels (uniform, the same in x and y) on each coordinate, and outliers, drawn
// uniformly, as the last of the matches.
struct SyntheticViews {
  static constexpr double kFocalLength = 900;
  static constexpr double kWidth = 1000;
  static constexpr double kHeight = 800;

  SyntheticViews(SyntheticScene scene, std::size_t num, double noise, double outliers,
                 std::uint64_t seed) {
    Random random({77, seed});
    const auto uniform = [&random](double least, double greatest) {
      return least + (greatest - least) * random.Uniform();
    };
    rotation = Eigen::AngleAxisd(
                   uniform(0.05, 0.2),
                   Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized())
                   .toRotationMatrix();
    translation = Eigen::Vector3d(uniform(0.5, 1), uniform(-0.5, 0.5), uniform(-0.5, 0.5));
    if (scene == SyntheticScene::kRotation) translation.setZero();
    if (scene == SyntheticScene::kTranslation) rotation.setIdentity();
    if (scene == SyntheticScene::kForward) {
      rotation.setIdentity();
      translation = Eigen::Vector3d(0, 0, -1);
    }
    const Eigen::Vector3d normal = Eigen::Vector3d(uniform(-0.3, 0.3), uniform(-0.3, 0.3), 1);
    num_inliers = num - static_cast<std::size_t>(outliers * static_cast<double>(num));
    while (pairs.size() < num_inliers) {
      const Eigen::Vector3d ray((uniform(0, kWidth) - kWidth / 2) / kFocalLength,
                                (uniform(0, kHeight) - kHeight / 2) / kFocalLength, 1);
      const double depth = scene == SyntheticScene::kPlane ? 5 / ray.dot(normal) : uniform(3, 8);
      const Eigen::Vector3d point = depth * ray;
      const Eigen::Vector3d moved = rotation * point + translation;
      if (moved.z() < 0.1) continue;
      const Eigen::Vector2d x1 = Project(point);
      const Eigen::Vector2d x2 = Project(moved);
      if (x2.x() < 0 || x2.x() > kWidth || x2.y() < 0 || x2.y() > kHeight) continue;
      const auto noisy = [&](double x) { return x + noise * uniform(-1, 1); };
      pairs.push_back({noisy(x1.x()), noisy(x1.y()), noisy(x2.x()), noisy(x2.y())});
      points.push_back(point);
    }
    while (pairs.size() < num) {
      pairs.push_back(
          {uniform(0, kWidth), uniform(0, kHeight), uniform(0, kWidth), uniform(0, kHeight)});
    }
  }

  static Eigen::Vector2d Project(const Eigen::Vector3d& point) {
    return {kFocalLength * point.x() / point.z() + kWidth / 2,
            kFocalLength * point.y() / point.z() + kHeight / 2};
  }

  // On the normalised image planes.
  static PointPair Normalized(const PointPair& pair) {
    return {(pair.x1 - kWidth / 2) / kFocalLength, (pair.y1 - kHeight / 2) / kFocalLength,
            (pair.x2 - kWidth / 2) / kFocalLength, (pair.y2 - kHeight / 2) / kFocalLength};
  }

  Eigen::Matrix3d Essential() const {
    Eigen::Matrix3d cross;
    cross << 0, -translation.z(), translation.y(), translation.z(), 0, -translation.x(),
        -translation.y(), translation.x(), 0;
    return cross * rotation;
  }

  std::vector<PointPair> pairs;
  std::size_t num_inliers = 0;
  std::vector<Eigen::Vector3d> points;  // Of the inliers, in the first camera's coordinates.
  Eigen::Matrix3d rotation;             // cam2_from_cam1
  Eigen::Vector3d translation;
};

}  // namespace colmap_graphmatch
