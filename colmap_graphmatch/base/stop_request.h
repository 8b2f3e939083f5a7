#pragma once

#include <atomic>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

// How a run is asked to end early. Lock-free, so that a signal handler may raise it.
class StopRequest {
 public:
  enum Level : int {
    kNone = 0,
    kFinishShards = 1,  // What is under way is finished and kept, nothing new is begun.
    kAbandonShards = 2  // What is under way is given up as well.
  };

  // Raises the level by one step, up to kAbandonShards.
  void Raise() noexcept {
    int level = level_.load();
    while (level < kAbandonShards && !level_.compare_exchange_weak(level, level + 1)) {
    }
  }

  // For work that is of no use unfinished: throws StoppedError at any level but kNone.
  void ThrowIfRequested() const {
    if (Requested()) throw StoppedError();
  }

  bool Requested() const noexcept { return level_.load() >= kFinishShards; }
  bool Abandon() const noexcept { return level_.load() >= kAbandonShards; }

 private:
  std::atomic<int> level_{kNone};
  static_assert(std::atomic<int>::is_always_lock_free);
};

}  // namespace colmap_graphmatch
