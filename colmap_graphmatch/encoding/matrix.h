#pragma once

#include <Eigen/Core>

namespace colmap_graphmatch {

// One descriptor or vector a row.
using RowMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using RowMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace colmap_graphmatch
