#pragma once

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/database/sqlite.h"

namespace colmap_graphmatch::sqlite {

// Pages that refer to each other in a damaged file can keep SQLite busy for ever, so its virtual
// machine gets no more instructions than take a second or two, and what it takes to go through the
// file once: fewer to prepare a statement, for then it reads the schema and parses every line of
// it; enough in a step to fill a shard of 100,000 pairs.
inline constexpr int kInstructionsPerProgressCall = 100000;
inline constexpr int kProgressCallsToPrepare = 5;
inline constexpr int kProgressCallsToRun = 300;

// In place of SQLite's own waiting, which nothing can interrupt.
struct Connection::Waiting {
  explicit Waiting(const LockPatience& with) : patience(with) {}

  // How long a write that is to be finished waits after the stop request.
  static constexpr double kSecondsToFinish = 2;

  LockPatience patience;
  bool finishes_writes = false;
  Stopwatch since;  // The first try.

  Stopwatch since_request;
  bool is_requested = false;

  bool IsRequested() const { return patience.stop != nullptr && patience.stop->Requested(); }

  bool Stops() {
    if (!IsRequested()) return false;
    if (!std::exchange(is_requested, true)) since_request = Stopwatch();
    return !finishes_writes || patience.stop->Abandon() ||
           since_request.Seconds() > kSecondsToFinish;
  }

  // SQLite's handler: whether to try again.
  static int Wait(void* self, int num_tries) {
    auto* waiting = static_cast<Waiting*>(self);
    if (num_tries == 0) waiting->since = Stopwatch();
    const double left = waiting->patience.seconds - waiting->since.Seconds();
    if (left <= 0 || waiting->Stops()) return 0;
    constexpr double kLongestPause = 0.05;
    const double pause = std::min({0.001 * (num_tries + 1), kLongestPause, left});
    std::this_thread::sleep_for(std::chrono::duration<double>(pause));
    return 1;
  }
};

}  // namespace colmap_graphmatch::sqlite
