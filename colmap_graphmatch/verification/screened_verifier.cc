#include "colmap_graphmatch/verification/screened_verifier.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/geometry/camera.h"
#include "colmap_graphmatch/geometry/two_view.h"
#include "colmap_graphmatch/verification/in_process.h"

namespace colmap_graphmatch {
namespace {

// A pair whose best fit has fewer than this share of the inliers that an edge needs (13 of 15) is
// settled: no edge of COLMAP's was among them (docs/benchmarks.md).
constexpr double kMinShareOfInliers = 0.86;

// A pair with fewer than this share (41 of 15) is close: whether COLMAP finds the last inlier
// depends on how long it searches, which is the shorter the fewer outliers there are. So it gets at
// least so many matches for each inlier, the nearest first; trials are for them in all pairs.
// (Pairs with few outliers need fewer, but not by as much as another start of COLMAP.)
constexpr double kMaxCloseShare = 2.7;
constexpr double kPadding = 2;

// COLMAP gets the matches within so many times max_error of a model: those that its own fit, which
// is a little different, may count.
constexpr double kBound = 1.5;

// What COLMAP is asked at once, and where the answers belong.
struct Question {
  std::vector<PairToVerify> pairs;
  std::vector<std::size_t> places;

  void Add(PairToVerify pair, std::size_t place) {
    pairs.push_back(std::move(pair));
    places.push_back(place);
  }
};

// The matches that are within `bound` times max_error of a model, or, if these are fewer, the
// `least_num` nearest; in their order.
FeatureMatches Nearest(const FeatureMatches& matches, const std::vector<double>& errors,
                       double bound, std::size_t least_num) {
  if (least_num >= matches.size()) return matches;
  std::vector<double> sorted = errors;
  const auto last =
      sorted.begin() + static_cast<std::ptrdiff_t>(std::max(least_num, std::size_t{1})) - 1;
  std::nth_element(sorted.begin(), last, sorted.end());
  const double greatest = std::max(bound, *last);
  FeatureMatches nearest;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (errors[i] <= greatest) nearest.push_back(matches[i]);
  }
  return nearest;
}

}  // namespace

ScreenedVerifier::ScreenedVerifier(const GeometryOptions& options, CamerasOfImages cameras,
                                   ColmapVerifier& colmap)
    : options_(options), cameras_(std::move(cameras)), colmap_(colmap) {}

FitStatistics ScreenedVerifier::SoFar() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return statistics_;
}

ShardOutcome ScreenedVerifier::Verify(const std::vector<PairToVerify>& pairs,
                                      const std::function<bool()>& should_stop) {
  const TwoViewOptions options = TwoViewOptionsOf(options_);
  const auto min_edge = static_cast<double>(options.min_num_inliers);
  ShardOutcome outcome;
  outcome.results.resize(pairs.size());
  Question trimmed;
  Question whole;
  FitStatistics statistics;
  const double start = ThreadCpuSeconds();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (should_stop()) {
      outcome.results.clear();
      outcome.stopped = true;
      return outcome;
    }
    const PairToVerify& pair = pairs[i];
    if (pair.points.empty() || !cameras_.CanJudge(pair.pair)) {
      whole.Add(pair, i);
      continue;
    }
    ++statistics.num_fitted;
    const ScreenedTwoViews screened =
        ScreenTwoViews({pair.pair, *cameras_.Of(pair.pair.id1), *cameras_.Of(pair.pair.id2),
                        pair.points, pair.distinctness},
                       options);
    const auto num_inliers = static_cast<double>(screened.num_inliers);
    if (num_inliers < kMinShareOfInliers * min_edge) {
      ++statistics.num_settled;
      PairGeometry& result = outcome.results[i];
      result.pair = pair.pair;
      result.matches = *pair.matches;
      result.geometry.configuration = ConfigurationOfUnmatched();
      continue;
    }
    const bool is_close = num_inliers < kMaxCloseShare * min_edge;
    const auto least_num = static_cast<std::size_t>(is_close ? kPadding * num_inliers : 0);
    PairToVerify kept;
    kept.pair = pair.pair;
    kept.matches = Nearest(*pair.matches, screened.errors, kBound, least_num);
    trimmed.Add(std::move(kept), i);
  }
  statistics.seconds = ThreadCpuSeconds() - start;

  const auto ask_colmap = [&](const Question& question, ColmapVerifier::Trials trials) {
    if (question.pairs.empty()) return true;
    ShardOutcome verdict = colmap_.Verify(question.pairs, trials, should_stop);
    if (verdict.stopped || !verdict.problem.empty()) {
      outcome = std::move(verdict);
      return false;
    }
    for (std::size_t i = 0; i < question.pairs.size(); ++i) {
      const PairToVerify& pair = pairs[question.places[i]];
      PairGeometry& result = outcome.results[question.places[i]];
      result = std::move(verdict.results[i]);
      if (pair.matches) result.matches = *pair.matches;
    }
    return true;
  };
  outcome.asked_colmap = !(trimmed.pairs.empty() && whole.pairs.empty());
  using Trials = ColmapVerifier::Trials;
  if (ask_colmap(trimmed, Trials::kForHalfInliers) && ask_colmap(whole, Trials::kAsAsked)) {
    const std::lock_guard<std::mutex> lock(mutex_);
    statistics_.seconds += statistics.seconds;
    statistics_.num_fitted += statistics.num_fitted;
    statistics_.num_settled += statistics.num_settled;
  }
  return outcome;
}

}  // namespace colmap_graphmatch
