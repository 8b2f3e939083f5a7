#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/geometry/refinement.h"

namespace colmap_graphmatch {

// How long to search, in COLMAP's terms (src/colmap/optim/ransac.h).
struct TrialBudget {
  double confidence = 0.999;
  double multiplier = 3;
  std::size_t min_num_trials = 100;
  std::size_t max_num_trials = 10000;
};

// The trials after which, with the given confidence, one of the samples had inliers only, times the
// multiplier: at least 1, at most max_num_trials.
std::size_t NumTrials(std::size_t num_inliers, std::size_t num_matches, std::size_t sample_size,
                      const TrialBudget& budget);

struct RobustProblem {
  ModelKind kind = ModelKind::kFundamental;
  double max_error = 0;  // In the coordinates that `pairs` was made from.
  TrialBudget budget;
  // Models with fewer inliers are of no use: the search need not go on for them.
  std::size_t num_needed = 0;
  // Best first; empty: no order is known. Of the rows of `pairs`.
  std::vector<std::size_t> order;
  // A model to begin with, in the coordinates that `pairs` was made from.
  std::optional<Eigen::Matrix3d> start;
};

struct RobustModel {
  // In the coordinates that `pairs` was made from; num_inliers 0: none was found.
  Eigen::Matrix3d model = Eigen::Matrix3d::Zero();
  std::size_t num_inliers = 0;
  std::size_t num_trials = 0;
};

// RANSAC (Fischler and Bolles, CACM 1981) with local optimisation (Chum, Matas and Kittler, DAGM
// 2003) of every model that fits more matches than all before, or as many with smaller errors; and,
// where none fits num_needed, of those to which a few are missing.
RobustModel EstimateRobustly(const RobustProblem& problem, const PointPairs& pairs, Random* random);

}  // namespace colmap_graphmatch
