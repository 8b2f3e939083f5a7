#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "colmap_graphmatch/geometry/point_pairs.h"

namespace colmap_graphmatch {

// What is done with all matches for every model that is tried. Highway picks the instruction set
// when the program runs; the results do not depend on it: no operation is fused, numbers are
// counted, and sums are formed in eight columns whatever the width of a vector.
//
// An epipolar model is F or E: a match fits it if its squared Sampson error (Hartley and Zisserman,
// Multiple View Geometry, 2nd ed., eq. 11.9) is at most max_squared_error. A homography takes
// points of image 1 to image 2; its error is the squared distance there. Errors are in the
// coordinates of the columns. Models of any scale; one with entries that are not finite fits
// nothing.
enum class ErrorKind { kEpipolar, kHomography };

// How many matches fit the model; 0 if it turns out that fewer than num_needed do.
std::size_t CountInliers(ErrorKind kind, const PointPairs& pairs, const Eigen::Matrix3d& model,
                         double max_squared_error, std::size_t num_needed);

// The least-squares problem of the matches that fit a model: residuals (one or two a match, their
// squares sum up to the error) and their derivatives by the nine entries of the model, row-major.
struct NormalEquations {
  Eigen::Matrix<double, 9, 9> jtj;
  Eigen::Matrix<double, 9, 1> jtr;
  double sum_squared = 0;
  std::size_t num_inliers = 0;
};
void ComputeNormalEquations(ErrorKind kind, const PointPairs& pairs, const Eigen::Matrix3d& model,
                            double max_squared_error, NormalEquations* equations);

}  // namespace colmap_graphmatch
