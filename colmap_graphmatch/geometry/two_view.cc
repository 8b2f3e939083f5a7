#include "colmap_graphmatch/geometry/two_view.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/geometry/inliers.h"
#include "colmap_graphmatch/geometry/robust_estimator.h"
#include "colmap_graphmatch/geometry/watermark.h"

namespace colmap_graphmatch {
namespace {

// Rows of `pairs`, the most promising match first; nothing if all are alike.
std::vector<std::size_t> OrderByPromise(const PointPairs& pairs,
                                        const std::vector<float>& promise) {
  std::vector<std::size_t> order;
  if (promise.empty()) return order;
  order.resize(pairs.Num());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto promise_of = [&](std::size_t row) {
    const float value = promise[pairs.Index(row)];
    return std::isnan(value) ? -std::numeric_limits<float>::infinity() : value;
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return promise_of(a) > promise_of(b); });
  return order;
}

Eigen::Matrix3d Calibration(const Camera& camera) {
  const PinholeParams k = PinholePart(camera);
  Eigen::Matrix3d calibration;
  calibration << k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1;
  return calibration;
}

bool IsCalibrated(const Camera& camera) {
  return camera.has_prior_focal_length && !WhyNotUsable(camera);
}

struct Fit {
  std::optional<Eigen::Matrix3d> model;
  std::vector<std::size_t> inliers;
};

// The models of two views, and all that they are found with.
class Search {
 public:
  Search(const TwoViews& views, const TwoViewOptions& options)
      : views_(views),
        options_(options),
        random_({views.pair.id1, views.pair.id2}),
        pairs_(views.matches),
        order_(OrderByPromise(pairs_, views.promise)) {
    is_calibrated_ = IsCalibrated(views.camera1) && IsCalibrated(views.camera2);
    if (!is_calibrated_) return;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    normalized_.reserve(views.matches.size());
    for (const PointPair& match : views.matches) {
      PointPair pair;
      if (!ToNormalizedPlane(views.camera1, match.x1, match.y1, &pair.x1, &pair.y1) ||
          !ToNormalizedPlane(views.camera2, match.x2, match.y2, &pair.x2, &pair.y2)) {
        pair.x1 = nan;
      }
      normalized_.push_back(pair);
    }
    // COLMAP's CamFromImgThreshold.
    essential_max_error_ =
        options.max_error *
        (1 / MeanFocalLength(views.camera1) + 1 / MeanFocalLength(views.camera2)) / 2;
  }

  void Run() {
    const std::size_t min = options_.min_num_inliers;
    FindFundamental(min);
    const std::size_t num_fundamental = fundamental.inliers.size();
    if (is_calibrated_) {
      FindEssential(std::max(min, Part(kMinEssentialRatio, num_fundamental)));
    }
    // The number that a homography has to beat: of E where it is believed, else of F.
    const ConfigurationChoice choice = Choose();
    const std::size_t rival = choice.configuration == TwoViewConfiguration::kCalibrated
                                  ? essential.inliers.size()
                                  : num_fundamental;
    FindHomography(choice.inliers == InlierSource::kNone ? min : Part(kMaxHomographyRatio, rival));
  }

  ConfigurationChoice Choose() const {
    return is_calibrated_ ? ChooseCalibrated(fundamental.inliers.size(), essential.inliers.size(),
                                             homography.inliers.size(), options_.min_num_inliers)
                          : ChooseUncalibrated(fundamental.inliers.size(),
                                               homography.inliers.size(), options_.min_num_inliers);
  }

  double EssentialMaxError() const { return essential_max_error_; }
  const std::vector<PointPair>& Normalized() const { return normalized_; }

  Fit fundamental;
  Fit essential;
  Fit homography;
  TwoViewTrials trials;

 private:
  // The least number above a part of `of`.
  static std::size_t Part(double ratio, std::size_t of) {
    return static_cast<std::size_t>(std::floor(ratio * static_cast<double>(of))) + 1;
  }

  RobustProblem Problem(ModelKind kind, std::size_t num_needed, std::size_t sample_size) const {
    RobustProblem problem;
    problem.kind = kind;
    problem.max_error = options_.max_error;
    problem.budget.confidence = options_.confidence;
    problem.budget.min_num_trials = options_.min_num_trials;
    problem.budget.max_num_trials = options_.max_num_trials;
    if (options_.min_inlier_ratio > 0) {
      constexpr std::size_t kMany = 100000;
      problem.budget.max_num_trials =
          NumTrials(static_cast<std::size_t>(options_.min_inlier_ratio * kMany), kMany, sample_size,
                    problem.budget);
    }
    problem.num_needed = num_needed;
    problem.order = order_;
    return problem;
  }

  void FindFundamental(std::size_t num_needed) {
    const RobustModel found =
        EstimateRobustly(Problem(ModelKind::kFundamental, num_needed, 7), pairs_, &random_);
    trials.fundamental = found.num_trials;
    Take(ErrorKind::kEpipolar, found, views_.matches, options_.max_error, &fundamental);
  }

  void FindEssential(std::size_t num_needed) {
    const PointPairs pairs(normalized_);
    RobustProblem problem = Problem(ModelKind::kEssential, num_needed, 5);
    problem.max_error = essential_max_error_;
    problem.order = OrderByPromise(pairs, views_.promise);
    if (fundamental.model) {
      problem.start = Calibration(views_.camera2).transpose() * *fundamental.model *
                      Calibration(views_.camera1);
    }
    const RobustModel found = EstimateRobustly(problem, pairs, &random_);
    trials.essential = found.num_trials;
    Take(ErrorKind::kEpipolar, found, normalized_, essential_max_error_, &essential);
  }

  void FindHomography(std::size_t num_needed) {
    const RobustModel found =
        EstimateRobustly(Problem(ModelKind::kHomography, num_needed, 4), pairs_, &random_);
    trials.homography = found.num_trials;
    Take(ErrorKind::kHomography, found, views_.matches, options_.max_error, &homography);
  }

  static void Take(ErrorKind kind, const RobustModel& found, const std::vector<PointPair>& pairs,
                   double max_error, Fit* fit) {
    if (found.num_inliers == 0) return;
    fit->model = found.model;
    fit->inliers = FindInliers(kind, found.model, pairs, max_error);
  }

  const TwoViews& views_;
  const TwoViewOptions& options_;
  Random random_;
  PointPairs pairs_;
  std::vector<std::size_t> order_;
  bool is_calibrated_ = false;
  std::vector<PointPair> normalized_;
  double essential_max_error_ = 0;
};

}  // namespace

TwoViewVerdict VerifyTwoViews(const TwoViews& views, const TwoViewOptions& options) {
  TwoViewVerdict geometry;
  if (views.matches.size() < options.min_num_inliers) return geometry;
  Search search(views, options);
  search.Run();
  geometry.trials = search.trials;
  geometry.fundamental = search.fundamental.model;
  geometry.essential = search.essential.model;
  geometry.homography = search.homography.model;
  const ConfigurationChoice choice = search.Choose();
  geometry.configuration = choice.configuration;
  switch (choice.inliers) {
    case InlierSource::kNone:
      return geometry;
    case InlierSource::kFundamental:
      geometry.inliers = search.fundamental.inliers;
      break;
    case InlierSource::kEssential:
      geometry.inliers = search.essential.inliers;
      break;
    case InlierSource::kHomography:
      geometry.inliers = search.homography.inliers;
      break;
  }
  if (options.compute_relative_pose &&
      geometry.configuration == TwoViewConfiguration::kCalibrated) {
    geometry.pose = PoseOfEssential(*geometry.essential, search.Normalized(), geometry.inliers);
  }
  if (options.detect_watermark &&
      IsWatermark(views.camera1, views.camera2, views.matches, geometry.inliers,
                  options.watermark_max_error.value_or(options.max_error))) {
    geometry.configuration = TwoViewConfiguration::kWatermark;
  }
  return geometry;
}

ScreenedTwoViews ScreenTwoViews(const TwoViews& views, const TwoViewOptions& options) {
  ScreenedTwoViews screened;
  Search search(views, options);
  search.Run();
  screened.trials = search.trials;
  std::vector<double> squared(views.matches.size(), std::numeric_limits<double>::infinity());
  const auto add = [&](const Fit& fit, ErrorKind kind, const std::vector<PointPair>& pairs,
                       double max_error) {
    if (!fit.model) return;
    screened.num_inliers = std::max(screened.num_inliers, fit.inliers.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double error = SquaredError(kind, *fit.model, pairs[i]) / (max_error * max_error);
      if (error < squared[i]) squared[i] = error;  // Not if it is not a number.
    }
  };
  add(search.fundamental, ErrorKind::kEpipolar, views.matches, options.max_error);
  add(search.essential, ErrorKind::kEpipolar, search.Normalized(), search.EssentialMaxError());
  add(search.homography, ErrorKind::kHomography, views.matches, options.max_error);
  screened.errors.reserve(squared.size());
  for (const double value : squared) screened.errors.push_back(std::sqrt(value));
  return screened;
}

}  // namespace colmap_graphmatch
