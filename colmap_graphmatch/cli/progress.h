#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "colmap_graphmatch/graph/exploration.h"

namespace colmap_graphmatch {

// Pairs a second in the recent past: what is t seconds old weighs exp(-t / kWindow).
class RecentRate {
 public:
  static constexpr double kWindow = 30;  // Seconds.

  // The total so far, at a time in seconds. Both ascend; what comes in the first half second is
  // the end of what was begun before, and does not count.
  void Update(double seconds, std::size_t total);

  // At a time not before the last update; 0 as long as it is not known.
  double At(double seconds) const;

 private:
  bool begun_ = false;
  double begin_ = 0;
  double last_ = 0;
  std::size_t last_total_ = 0;
  double weighted_count_ = 0;
  double weighted_seconds_ = 0;
};

// How long the tests to come take. Samples get cheaper from iteration to iteration, since those
// that are less alike have fewer matches and need no geometric verification: they are taken to go
// on as they did in the last two. All other tests are taken at the recent rate of their like.
class TimeLeft {
 public:
  void Update(double seconds, const LoopProgress& progress);

  // In seconds, at a time not before the last update; negative: not known yet.
  double At(double seconds) const;

 private:
  // The samples of an iteration.
  struct Batch {
    int iteration = -1;
    std::size_t num_tested = 0;
    double seconds = 0;

    double SecondsPerTest() const { return seconds / static_cast<double>(num_tested); }
  };

  // Of the samples to come, on average; 0 as long as there is no sample.
  double SecondsPerSample() const;

  std::vector<Batch> sampling_;  // The last three, with that which is tested now.
  RecentRate others_;            // Over their own seconds.
  double seconds_of_others_ = 0;
  std::size_t num_others_ = 0;
  bool begun_ = false;
  double last_ = 0;
  LoopProgress progress_;
};

// Where a run is, as a terminal and a log show it.
struct ProgressView {
  LoopProgress loop;
  // Of the stage of this iteration alone.
  std::size_t num_tested_now = 0;
  std::size_t num_edges_now = 0;
  double rate = 0;           // Pairs a second in the recent past; 0: not known yet.
  double seconds = 0;        // Since the first answer.
  double seconds_left = -1;  // Negative: not known yet.

  double ShareDone() const;  // Of the tests, those to come as expected.
};

// "propagation 3", iterations counted from 1; stages that do not repeat have no number.
std::string StageTitle(LoopStage stage, int iteration);

// The progress as lines of at most `width` columns, 2 to 4 of them from 60 columns on: fields flow
// to as many lines as they need and none is cut.
std::vector<std::string> FormatBlock(const ProgressView& view, std::size_t width);

// The same for a log, in one line.
std::string FormatProgress(const ProgressView& view);

// "12.3 s", "3.4 min", "5.1 h".
std::string FormatDuration(double seconds);

}  // namespace colmap_graphmatch
