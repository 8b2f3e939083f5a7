#pragma once

#include "colmap_graphmatch/base/stopwatch.h"

namespace colmap_graphmatch {

// Calls the function and says how long it took.
template <typename Function>
auto Timed(double* seconds, const Function& function) {
  const Stopwatch stopwatch;
  auto result = function();
  *seconds = stopwatch.Seconds();
  return result;
}

}  // namespace colmap_graphmatch
