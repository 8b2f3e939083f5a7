#pragma once

#include <filesystem>
#include <string>

#include "colmap_graphmatch/graph/explorer.h"

namespace colmap_graphmatch {

// What a run tells while it goes on. Called on the thread that called RunPipeline.
class PipelineObserver {
 public:
  virtual ~PipelineObserver() = default;
  virtual void OnInfo(const std::string& message) = 0;
  virtual void OnWarning(const std::string& message) = 0;
  virtual void OnProgress(const LoopProgress& progress) = 0;
};

// For files of which lines are left out: List has num_skipped and first_skipped.
template <typename List>
void WarnOfSkippedLines(const List& list, const std::filesystem::path& path,
                        const std::string& what, PipelineObserver& observer) {
  if (list.num_skipped == 0) return;
  observer.OnWarning(std::to_string(list.num_skipped) + " line(s) of " + path.string() +
                     " that do not name " + what +
                     " of the database with features are skipped; the first is \"" +
                     list.first_skipped + "\".");
}

}  // namespace colmap_graphmatch
