#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"

namespace colmap_graphmatch {

// A column of each coordinate.
struct PointColumns {
  const float* x1;
  const float* y1;
  const float* x2;
  const float* y2;
};

// The finite ones among some matches, column by column, in coordinates in which single precision
// does: moved so that the middle of each image's points is the origin, and divided by one scale for
// both images, so that all are within -1 .. 1. Both the Sampson error and the transfer error are
// thereby divided by the scale, and nothing else.
class PointPairs {
 public:
  // Rows are padded to a multiple of this with NaN, which is no inlier of any model.
  static constexpr std::size_t kPadding = 16;

  explicit PointPairs(const std::vector<PointPair>& pairs);

  std::size_t Num() const { return indices_.size(); }
  std::size_t NumPadded() const { return stride_; }

  // Which of the given matches a row is.
  std::size_t Index(std::size_t row) const { return indices_[row]; }

  PointColumns Columns() const {
    const float* begin = columns_.data();
    return {begin, begin + stride_, begin + 2 * stride_, begin + 3 * stride_};
  }

  // A row.
  PointPair Row(std::size_t row) const {
    const float* begin = columns_.data() + row;
    return {begin[0], begin[stride_], begin[2 * stride_], begin[3 * stride_]};
  }

  // A row as it was given, but for single precision.
  PointPair GivenRow(std::size_t row) const {
    const PointPair pair = Row(row);
    return {pair.x1 * scale_ + middle1_.x(), pair.y1 * scale_ + middle1_.y(),
            pair.x2 * scale_ + middle2_.x(), pair.y2 * scale_ + middle2_.y()};
  }

  double Scale() const { return scale_; }

  // Of the given coordinates: what takes them to those of the columns.
  Eigen::Matrix3d Transform1() const { return Transform(middle1_); }
  Eigen::Matrix3d Transform2() const { return Transform(middle2_); }

 private:
  Eigen::Matrix3d Transform(const Eigen::Vector2d& middle) const;

  std::vector<std::size_t> indices_;
  std::size_t stride_ = 0;
  std::vector<float> columns_;
  double scale_ = 1;
  Eigen::Vector2d middle1_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d middle2_ = Eigen::Vector2d::Zero();
};

}  // namespace colmap_graphmatch
