#pragma once

#include <Eigen/Core>
#include <cmath>

#include "colmap_graphmatch/geometry/point_pairs.h"

namespace colmap_graphmatch {

// An orthonormal basis of the vectors f of nine entries, row-major those of a matrix F, with
// x2^T F x1 = 0 for kNum pairs: the last columns of Q in the QR decomposition, by Householder's
// reflections, of the matrix whose columns are the pairs' equations.
template <int kNum>
Eigen::Matrix<double, 9, 9 - kNum> EpipolarNullSpace(const PointPair* pairs) {
  double a[kNum][9];  // A column of the matrix after the other.
  for (int k = 0; k < kNum; ++k) {
    const PointPair& pair = pairs[k];
    a[k][0] = pair.x2 * pair.x1;
    a[k][1] = pair.x2 * pair.y1;
    a[k][2] = pair.x2;
    a[k][3] = pair.y2 * pair.x1;
    a[k][4] = pair.y2 * pair.y1;
    a[k][5] = pair.y2;
    a[k][6] = pair.x1;
    a[k][7] = pair.y1;
    a[k][8] = 1;
  }
  double factors[kNum];
  for (int k = 0; k < kNum; ++k) {
    double square = 0;
    for (int i = k; i < 9; ++i) square += a[k][i] * a[k][i];
    // The reflection of the column onto an axis is along v = column + sign norm e_k.
    const double norm = std::copysign(std::sqrt(square), a[k][k]);
    a[k][k] += norm;
    const double factor = norm * a[k][k];
    factors[k] = factor > 0 ? 1 / factor : 0;
    for (int j = k + 1; j < kNum; ++j) {
      double dot = 0;
      for (int i = k; i < 9; ++i) dot += a[k][i] * a[j][i];
      dot *= factors[k];
      for (int i = k; i < 9; ++i) a[j][i] -= dot * a[k][i];
    }
  }
  Eigen::Matrix<double, 9, 9 - kNum> basis;
  for (int column = 0; column < 9 - kNum; ++column) {
    double q[9] = {};
    q[kNum + column] = 1;
    for (int k = kNum - 1; k >= 0; --k) {
      double dot = 0;
      for (int i = k; i < 9; ++i) dot += a[k][i] * q[i];
      dot *= factors[k];
      for (int i = k; i < 9; ++i) q[i] -= dot * a[k][i];
    }
    for (int i = 0; i < 9; ++i) basis(i, column) = q[i];
  }
  return basis;
}

}  // namespace colmap_graphmatch
