#pragma once

#include <string>

#include "colmap_graphmatch/graph/exploration.h"

namespace colmap_graphmatch {

// What a run tells while it goes on. Called on the thread that called RunPipeline or
// FindCandidates.
class PipelineObserver {
 public:
  virtual ~PipelineObserver() = default;
  virtual void OnInfo(const std::string& message) = 0;
  virtual void OnWarning(const std::string& message) = 0;
  virtual void OnProgress(const LoopProgress& progress) = 0;
};

}  // namespace colmap_graphmatch
