#include "colmap_graphmatch/geometry/point_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace colmap_graphmatch {
namespace {

// No image has such coordinates, and what is larger could overflow in single precision when it is
// multiplied.
constexpr double kMaxCoordinate = 1e6;

bool IsUsable(double coordinate) { return std::abs(coordinate) <= kMaxCoordinate; }

bool IsUsable(const PointPair& pair) {
  return IsUsable(pair.x1) && IsUsable(pair.y1) && IsUsable(pair.x2) && IsUsable(pair.y2);
}

}  // namespace

PointPairs::PointPairs(const std::vector<PointPair>& pairs) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Array4d least = Eigen::Array4d::Constant(kInfinity);
  Eigen::Array4d greatest = Eigen::Array4d::Constant(-kInfinity);
  indices_.reserve(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PointPair& pair = pairs[i];
    if (!IsUsable(pair)) continue;
    indices_.push_back(i);
    const Eigen::Array4d row(pair.x1, pair.y1, pair.x2, pair.y2);
    least = least.min(row);
    greatest = greatest.max(row);
  }
  stride_ = (indices_.size() + kPadding - 1) / kPadding * kPadding;
  columns_.assign(4 * stride_, std::numeric_limits<float>::quiet_NaN());
  if (indices_.empty()) return;
  const Eigen::Array4d middle = (least + greatest) / 2;
  middle1_ = middle.head<2>();
  middle2_ = middle.tail<2>();
  const double extent = (greatest - least).maxCoeff() / 2;
  if (extent > 0) scale_ = extent;
  for (std::size_t row = 0; row < indices_.size(); ++row) {
    const PointPair& pair = pairs[indices_[row]];
    columns_[row] = static_cast<float>((pair.x1 - middle(0)) / scale_);
    columns_[stride_ + row] = static_cast<float>((pair.y1 - middle(1)) / scale_);
    columns_[2 * stride_ + row] = static_cast<float>((pair.x2 - middle(2)) / scale_);
    columns_[3 * stride_ + row] = static_cast<float>((pair.y2 - middle(3)) / scale_);
  }
}

Eigen::Matrix3d PointPairs::Transform(const Eigen::Vector2d& middle) const {
  Eigen::Matrix3d transform;
  transform << 1 / scale_, 0, -middle(0) / scale_, 0, 1 / scale_, -middle(1) / scale_, 0, 0, 1;
  return transform;
}

}  // namespace colmap_graphmatch
