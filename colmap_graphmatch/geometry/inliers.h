#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "colmap_graphmatch/geometry/point_pairs.h"
#include "colmap_graphmatch/geometry/scoring.h"

namespace colmap_graphmatch {

// The squared error of a match (scoring.h), in double precision and in the coordinates of the
// matches, as COLMAP computes it; not a number where the model says nothing.
double SquaredError(ErrorKind kind, const Eigen::Matrix3d& model, const PointPair& pair);

// Which matches are within max_error of a model, ascending: what a verdict rests on.
std::vector<std::size_t> FindInliers(ErrorKind kind, const Eigen::Matrix3d& model,
                                     const std::vector<PointPair>& pairs, double max_error);

}  // namespace colmap_graphmatch
