#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>

#include "colmap_graphmatch/base/output_file.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/cli/log_options.h"
#include "colmap_graphmatch/cli/progress.h"
#include "colmap_graphmatch/pipeline/observer.h"

namespace spdlog {
class logger;
}

namespace colmap_graphmatch {

class TerminalSink;

// The log and the progress of a run. Lines look like glog's:
//   I20261124 14:12:53.123456 12345 graphmatch_matcher] message
// On a terminal a block of lines below them shows the progress; elsewhere it is logged, after 1, 2,
// 5 and then every 10 seconds. A thread of its own draws the block, at most ten times a second.
class Console : public PipelineObserver {
 public:
  // Throws FileError if the log file cannot be written.
  explicit Console(const LogOptions& options);
  ~Console() override;
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  void OnInfo(const std::string& message) override;
  void OnWarning(const std::string& message) override;
  void OnProgress(const LoopProgress& progress) override;
  void Error(const std::string& message);

  // Takes the block away: nothing more is to come.
  void EndProgress();

  // Has it said that the run ends soon. Lock-free: for a signal handler.
  void NoteInterrupt() noexcept { interrupted_ = true; }

  // Has the block begin on a new line, as after Ctrl-Z and fg. For the handler of SIGCONT.
  void NoteContinue() noexcept { continued_ = true; }

 private:
  using Clock = std::chrono::steady_clock;

  void Watch();
  void Log(int level, const std::string& message, bool on_terminal = true);
  void LogProgressIfDue(double seconds);
  bool OwnsScreen() const;
  void LogStage();
  void Draw(double seconds);
  double Seconds() const;  // Since the first answer.
  ProgressView View(double seconds) const;

  LogOptions options_;
  std::FILE* stream_;
  bool has_color_ = false;
  bool has_block_ = false;  // The stream is a terminal that can show one.
  std::shared_ptr<TerminalSink> sink_;
  std::unique_ptr<spdlog::logger> terminal_log_;
  std::unique_ptr<GrowingFile> file_;
  std::unique_ptr<spdlog::logger> file_log_;

  std::mutex mutex_;  // Of everything below.
  std::condition_variable ended_;
  bool ends_ = false;
  bool has_progress_ = false;
  LoopProgress progress_;
  Clock::time_point start_;
  StageStatistics before_stage_;
  RecentRate rate_;
  TimeLeft time_left_;
  double next_logged_ = 1;  // Seconds.
  double last_drawn_ = 0;
  bool is_drawn_current_ = false;
  bool said_interrupted_ = false;
  bool said_log_fails_ = false;

  std::atomic<bool> interrupted_{false};
  std::atomic<bool> continued_{false};
  static_assert(std::atomic<bool>::is_always_lock_free);
  // None if the system gives none: then there is no block.
  std::unique_ptr<ThreadGroup> watcher_;
};

// With '?' in their place, but for line ends and tabs. Names from a database could otherwise give
// orders to the terminal.
std::string WithoutControlCharacters(std::string text);

}  // namespace colmap_graphmatch
