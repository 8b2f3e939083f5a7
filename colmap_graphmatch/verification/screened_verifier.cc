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

// A pair with fewer than this share (21 of 15) is close: COLMAP gets it as it is. Whether it finds
// the last inlier depends on how long it searches, which is the shorter the fewer outliers there
// are.
constexpr double kMaxCloseShare = 1.34;

// COLMAP gets the matches within so many times max_error of a model: those that its own fit, which
// is a little different, may count.
constexpr double kBound = 1.5;

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
  // Where the results of what COLMAP gets belong.
  std::vector<PairToVerify> trimmed;
  std::vector<std::size_t> places_of_trimmed;
  std::vector<PairToVerify> whole;
  std::vector<std::size_t> places_of_whole;
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
      whole.push_back(pair);
      places_of_whole.push_back(i);
      continue;
    }
    ++statistics.num_fitted;
    const ScreenedTwoViews screened =
        ScreenTwoViews({pair.pair, *cameras_.Of(pair.pair.id1), *cameras_.Of(pair.pair.id2),
                        pair.points, pair.distinctness},
                       options, kBound);
    if (static_cast<double>(screened.num_inliers) < kMinShareOfInliers * min_edge) {
      ++statistics.num_settled;
      PairGeometry& result = outcome.results[i];
      result.pair = pair.pair;
      result.matches = *pair.matches;
      result.geometry.configuration = ConfigurationOfUnmatched();
      continue;
    }
    if (static_cast<double>(screened.num_inliers) < kMaxCloseShare * min_edge) {
      whole.push_back(pair);
      places_of_whole.push_back(i);
      continue;
    }
    PairToVerify& kept = trimmed.emplace_back();
    kept.pair = pair.pair;
    kept.matches.emplace();
    kept.matches->reserve(screened.near.size());
    for (const std::size_t match : screened.near) kept.matches->push_back((*pair.matches)[match]);
    places_of_trimmed.push_back(i);
  }
  statistics.seconds = ThreadCpuSeconds() - start;

  const auto ask_colmap = [&](const std::vector<PairToVerify>& asked,
                              const std::vector<std::size_t>& places,
                              ColmapVerifier::Trials trials) {
    if (asked.empty()) return true;
    ShardOutcome verdict = colmap_.Verify(asked, trials, should_stop);
    if (verdict.stopped || !verdict.problem.empty()) {
      outcome = std::move(verdict);
      return false;
    }
    for (std::size_t i = 0; i < asked.size(); ++i) {
      PairGeometry& result = outcome.results[places[i]];
      result = std::move(verdict.results[i]);
      const PairToVerify& pair = pairs[places[i]];
      if (pair.matches) result.matches = *pair.matches;
    }
    return true;
  };
  if (ask_colmap(trimmed, places_of_trimmed, ColmapVerifier::Trials::kFew) &&
      ask_colmap(whole, places_of_whole, ColmapVerifier::Trials::kAsAsked)) {
    const std::lock_guard<std::mutex> lock(mutex_);
    statistics_.seconds += statistics.seconds;
    statistics_.num_fitted += statistics.num_fitted;
    statistics_.num_settled += statistics.num_settled;
  }
  return outcome;
}

}  // namespace colmap_graphmatch
