#include "colmap_graphmatch/geometry/robust_estimator.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "colmap_graphmatch/geometry/minimal_solvers.h"

namespace colmap_graphmatch {
namespace {

// Where no model has enough inliers, those of which so many are missing, or fewer, are refined,
// too: with few matches to search in, that finds the missing ones more often than further samples
// do.
constexpr std::size_t kClose = 3;

// Trials in which samples come from the more promising matches (as in PROSAC, Chum and Matas, CVPR
// 2005): from more of them with every trial, then from all.
constexpr std::size_t kNumPromising = 50;

// Draws rows without repetition, of the first num.
template <std::size_t kSize>
void Draw(std::size_t num, const std::vector<std::size_t>& order, Random* random,
          std::array<std::size_t, kSize>* rows) {
  for (std::size_t i = 0; i < kSize; ++i) {
    bool is_new = false;
    while (!is_new) {
      (*rows)[i] = random->Index(num);
      is_new = std::find(rows->begin(), rows->begin() + i, (*rows)[i]) == rows->begin() + i;
    }
  }
  if (order.empty()) return;
  for (std::size_t& row : *rows) row = order[row];
}

template <ModelKind kKind>
struct Solver;
template <>
struct Solver<ModelKind::kFundamental> {
  static constexpr std::size_t kSample = kFundamentalSample;
  static constexpr auto kSolve = SolveFundamental;
};
template <>
struct Solver<ModelKind::kEssential> {
  static constexpr std::size_t kSample = kEssentialSample;
  static constexpr auto kSolve = SolveEssential;
};
template <>
struct Solver<ModelKind::kHomography> {
  static constexpr std::size_t kSample = kHomographySample;
  static constexpr auto kSolve = SolveHomography;
};

template <ModelKind kKind>
RobustModel Estimate(const RobustProblem& problem, const PointPairs& pairs, Random* random) {
  constexpr std::size_t kSample = Solver<kKind>::kSample;
  RobustModel result;
  const std::size_t num = pairs.Num();
  if (num < std::max(kSample, problem.num_needed)) return result;
  const Eigen::Matrix3d transform1 = pairs.Transform1();
  const Eigen::Matrix3d transform2 = pairs.Transform2();
  const double max_squared_error = std::pow(problem.max_error / pairs.Scale(), 2);
  const Eigen::Matrix3d inverse1 = transform1.inverse();
  const Eigen::Matrix3d inverse2 = transform2.inverse();
  const Refiner refiner(kKind, pairs, max_squared_error, inverse1, inverse2);
  FittedModel best;
  const auto num_trials = [&] {
    return std::max(
        problem.budget.min_num_trials,
        NumTrials(std::max(best.num_inliers, problem.num_needed), num, kSample, problem.budget));
  };
  std::size_t max_num_trials = num_trials();
  // The fewest inliers with which a model is worth refining.
  const auto least_count = [&] {
    const std::size_t best_count = best.num_inliers;
    const std::size_t least = best_count > kSample ? best_count : best_count + 1;
    const bool is_close =
        best_count < problem.num_needed && best_count + kClose >= problem.num_needed;
    return is_close ? std::min(least, problem.num_needed - kClose) : least;
  };
  const auto consider = [&](const Eigen::Matrix3d& model) {
    const std::size_t count =
        CountInliers(ErrorOf(kKind), pairs, model, max_squared_error, least_count());
    if (count == 0) return;
    if (count == best.num_inliers && count >= problem.num_needed) {
      NormalEquations equations;
      ComputeNormalEquations(ErrorOf(kKind), pairs, model.normalized(), max_squared_error,
                             &equations);
      if (!(equations.sum_squared < best.sum_squared)) return;
    }
    const FittedModel refined = refiner.Refine(model);
    if (refined.IsBetterThan(best)) best = refined;
    max_num_trials = num_trials();
  };
  const auto to_columns = [&](const Eigen::Matrix3d& model) -> Eigen::Matrix3d {
    return kKind == ModelKind::kHomography
               ? Eigen::Matrix3d(transform2 * model * inverse1)
               : Eigen::Matrix3d(inverse2.transpose() * model * inverse1);
  };
  const auto from_columns = [&](const Eigen::Matrix3d& model) -> Eigen::Matrix3d {
    return kKind == ModelKind::kHomography
               ? Eigen::Matrix3d(inverse2 * model * transform1)
               : Eigen::Matrix3d(transform2.transpose() * model * transform1);
  };
  if (problem.start) consider(to_columns(*problem.start));

  std::array<std::size_t, kSample> rows{};
  std::array<PointPair, kSample> sample;
  MinimalModels models;
  while (result.num_trials < max_num_trials && result.num_trials < problem.budget.max_num_trials) {
    std::size_t num_drawn_from = num;
    if (!problem.order.empty() && result.num_trials < kNumPromising) {
      num_drawn_from = kSample + (num - kSample) * (result.num_trials + 1) / kNumPromising;
    }
    ++result.num_trials;
    Draw(num_drawn_from, problem.order, random, &rows);
    for (std::size_t i = 0; i < kSample; ++i) {
      // The five-point solver wants normalised image planes.
      sample[i] = kKind == ModelKind::kEssential ? pairs.GivenRow(rows[i]) : pairs.Row(rows[i]);
    }
    Solver<kKind>::kSolve(sample, &models);
    for (std::size_t i = 0; i < models.num; ++i) {
      const Eigen::Matrix3d& model = models.models[i];
      consider(kKind == ModelKind::kEssential ? to_columns(model) : model);
    }
  }
  result.num_inliers = best.num_inliers;
  if (best.num_inliers > 0) result.model = from_columns(best.model);
  return result;
}

}  // namespace

std::size_t NumTrials(std::size_t num_inliers, std::size_t num_matches, std::size_t sample_size,
                      const TrialBudget& budget) {
  const double ratio = static_cast<double>(num_inliers) / static_cast<double>(num_matches);
  const double success = std::pow(ratio, static_cast<double>(sample_size));
  if (success >= 1) return 1;
  const double trials =
      std::ceil(std::log(1 - budget.confidence) / std::log1p(-success) * budget.multiplier);
  // Also where nothing fits, and the quotient is infinite or not a number.
  if (!(trials < static_cast<double>(budget.max_num_trials))) return budget.max_num_trials;
  return static_cast<std::size_t>(std::max(1.0, trials));
}

RobustModel EstimateRobustly(const RobustProblem& problem, const PointPairs& pairs,
                             Random* random) {
  switch (problem.kind) {
    case ModelKind::kFundamental:
      return Estimate<ModelKind::kFundamental>(problem, pairs, random);
    case ModelKind::kEssential:
      return Estimate<ModelKind::kEssential>(problem, pairs, random);
    case ModelKind::kHomography:
      break;
  }
  return Estimate<ModelKind::kHomography>(problem, pairs, random);
}

}  // namespace colmap_graphmatch
