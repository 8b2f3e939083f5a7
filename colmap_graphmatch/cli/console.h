#pragma once

#include <chrono>
#include <cstdio>
#include <string>

#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"

namespace colmap_graphmatch {

// Messages and progress on a stream: one line that is rewritten in place on a terminal, a new line
// every few seconds otherwise.
class Console : public PipelineObserver {
 public:
  explicit Console(std::FILE* stream);
  ~Console() override;
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  void OnInfo(const std::string& message) override;
  void OnWarning(const std::string& message) override;
  void OnProgress(const LoopProgress& progress) override;

  // Ends the line in place, if one is shown.
  void ClearProgress();

 private:
  void Print(const std::string& text);

  using Clock = std::chrono::steady_clock;

  std::FILE* stream_;
  bool is_terminal_;
  bool showing_progress_ = false;
  Clock::time_point start_of_matching_;
  Clock::time_point last_progress_;
  bool matching_ = false;
};

// With '?' in their place, but for line ends and tabs. Names from a database could otherwise give
// orders to the terminal.
std::string WithoutControlCharacters(std::string text);

// "12 s", "3.4 min", "5.1 h".
std::string FormatDuration(double seconds);

// The progress in one line: stage, pairs tested, edges, efficiency, components, rate, time left.
std::string FormatProgress(const LoopProgress& progress, double seconds_of_matching);

// What the run found and what it cost.
std::string FormatSummary(const PipelineOptions& options, const PipelineResult& result);

}  // namespace colmap_graphmatch
