#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/geometry/camera.h"
#include "colmap_graphmatch/geometry/configuration.h"
#include "colmap_graphmatch/geometry/point_pairs.h"
#include "colmap_graphmatch/geometry/relative_pose.h"

namespace colmap_graphmatch {

// COLMAP's options of the same names and defaults (TwoViewGeometryOptions, RANSACOptions).
struct TwoViewOptions {
  double max_error = 4;  // Pixels.
  std::size_t min_num_inliers = 15;
  double confidence = 0.999;
  std::size_t min_num_trials = 100;
  std::size_t max_num_trials = 10000;
  double min_inlier_ratio = 0.25;  // No trials for what fits fewer. 0: none is given.
  bool detect_watermark = true;
  std::optional<double> watermark_max_error;  // Pixels; as max_error if it is not set.
  bool compute_relative_pose = false;
};

// What is known of two images. The pair's ids seed all random numbers: with the same input the
// result is the same, bit for bit, on any number of threads and any processor of an architecture.
// (Both functions below are thread-safe.)
struct TwoViews {
  ImagePair pair;
  const Camera& camera1;
  const Camera& camera2;
  const std::vector<PointPair>& matches;  // In pixels.
  // How likely a match is to be right: greater is better, in any unit. Empty: not known.
  const std::vector<float>& promise;
};

// Where the time went.
struct TwoViewTrials {
  std::size_t fundamental = 0;
  std::size_t essential = 0;
  std::size_t homography = 0;
};

// A typed geometry (base/two_view_geometry.h) in the making.
struct TwoViewVerdict {
  TwoViewConfiguration configuration = TwoViewConfiguration::kDegenerate;
  std::vector<std::size_t> inliers;  // Of the matches, ascending.
  // The models that were found. In pixels; E on the normalised image planes.
  std::optional<Eigen::Matrix3d> fundamental;
  std::optional<Eigen::Matrix3d> essential;
  std::optional<Eigen::Matrix3d> homography;
  std::optional<RelativeMotion> pose;  // Of calibrated pairs, if it was asked for.
  TwoViewTrials trials;
};

// COLMAP's verdict (EstimateCalibratedTwoViewGeometry if both cameras have a prior focal length,
// else EstimateUncalibratedTwoViewGeometry, of COLMAP 3.8) with our search. Who has cameras that
// are not usable (WhyNotUsable) should not ask; they count as ones without a prior focal length.
// Fewer matches than min_num_inliers: degenerate.
TwoViewVerdict VerifyTwoViews(const TwoViews& views, const TwoViewOptions& options);

// For who asks COLMAP in the end: how near the matches are to the best models.
struct ScreenedTwoViews {
  // The most inliers that a model has.
  std::size_t num_inliers = 0;
  // Of every match: the error of the model that it is nearest to, over max_error; infinite where
  // no model says anything.
  std::vector<double> errors;
  TwoViewTrials trials;
};
ScreenedTwoViews ScreenTwoViews(const TwoViews& views, const TwoViewOptions& options);

}  // namespace colmap_graphmatch
