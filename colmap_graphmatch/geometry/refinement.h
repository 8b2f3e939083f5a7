#pragma once

#include <Eigen/Core>

#include "colmap_graphmatch/geometry/point_pairs.h"
#include "colmap_graphmatch/geometry/scoring.h"

namespace colmap_graphmatch {

enum class ModelKind { kFundamental, kEssential, kHomography };

inline ErrorKind ErrorOf(ModelKind kind) {
  return kind == ModelKind::kHomography ? ErrorKind::kHomography : ErrorKind::kEpipolar;
}

// A model and how many matches fit it. Errors are those of scoring.h, in the coordinates of the
// columns.
struct FittedModel {
  Eigen::Matrix3d model = Eigen::Matrix3d::Zero();
  std::size_t num_inliers = 0;
  double sum_squared = 0;  // Of their errors.

  // COLMAP's order (InlierSupportMeasurer).
  bool IsBetterThan(const FittedModel& other) const {
    return num_inliers > other.num_inliers ||
           (num_inliers == other.num_inliers && sum_squared < other.sum_squared);
  }
};

// What fits more matches near a model, if there is something: the best that some steps of
// Levenberg and Marquardt come past, which lessen the truncated squared error, the sum over all
// matches of min(error^2, max_squared_error). F stays of rank 2 (7 degrees of freedom), E keeps two
// equal singular values and a third of zero (5); of H all 9 entries move. In the coordinates of the
// columns an essential matrix is to_normalized2^T E to_normalized1, `to_normalized` taking columns
// to normalised image planes; they are the identity for F and H.
class Refiner {
 public:
  Refiner(ModelKind kind, const PointPairs& pairs, double max_squared_error,
          const Eigen::Matrix3d& to_normalized1, const Eigen::Matrix3d& to_normalized2);

  FittedModel Refine(const Eigen::Matrix3d& model) const;

 private:
  FittedModel RefineHomography(const Eigen::Matrix3d& model) const;
  FittedModel RefineEpipolar(const Eigen::Matrix3d& model) const;

  ModelKind kind_;
  const PointPairs& pairs_;
  double max_squared_error_;
  Eigen::Matrix3d to_normalized1_;
  Eigen::Matrix3d to_normalized2_;
};

}  // namespace colmap_graphmatch
