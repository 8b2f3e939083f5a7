#pragma once

#include <optional>

namespace colmap_graphmatch {

// COLMAP's TwoViewGeometryOptions (src/colmap/estimators/two_view_geometry.h) of every version from
// 3.8 on, with its names. What is not set has the default of the COLMAP that is installed.
struct GeometryOptions {
  // Inliers that make a pair an edge; 0 is as good as 1.
  int min_num_inliers = 15;

  // Greatest error of an inlier, in pixels; positive.
  std::optional<double> max_error;

  // RANSAC: the probability that it finds the best model, and the share of inliers that it counts
  // on at least, both in [0, 1], and trials at most. From autumn 2026 on COLMAP also rejects pairs
  // with a smaller share.
  std::optional<double> confidence;
  std::optional<double> min_inlier_ratio;
  std::optional<int> max_num_trials;
  std::optional<int> random_seed;  // The same for every pair; -1: of the thread.

  std::optional<bool> guided_matching;
  std::optional<bool> multiple_models;
  std::optional<bool> multiple_ignore_watermark;
  std::optional<bool> compute_relative_pose;
  std::optional<bool> planar_scene;  // 3.8 alone.
  std::optional<bool> use_degensac;
  std::optional<bool> use_sampson_refinement;

  // Pairs that only a watermark links, and matches at the same place in both images, with errors in
  // pixels; positive.
  std::optional<bool> detect_watermark;
  std::optional<double> watermark_detection_max_error;
  std::optional<bool> filter_stationary_matches;
  std::optional<double> stationary_matches_max_error;

  // Throws OptionsError.
  void Check() const;
};

}  // namespace colmap_graphmatch
