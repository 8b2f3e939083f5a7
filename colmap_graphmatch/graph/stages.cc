#include "colmap_graphmatch/graph/stages.h"

namespace colmap_graphmatch {

const char* StageName(LoopStage stage) {
  switch (stage) {
    case LoopStage::kSampling:
      return "sampling";
    case LoopStage::kPropagation:
      return "propagation";
    case LoopStage::kRetrieval:
      return "retrieval";
    case LoopStage::kExpansion:
      return "expansion";
    case LoopStage::kListed:
      return "listed";
    case LoopStage::kLikeliest:
      return "likeliest";
  }
  return "unknown";
}

StageStatistics operator+(const StageStatistics& a, const StageStatistics& b) {
  StageStatistics sum;
  sum.num_tested = a.num_tested + b.num_tested;
  sum.num_edges = a.num_edges + b.num_edges;
  sum.num_failed = a.num_failed + b.num_failed;
  sum.num_known = a.num_known + b.num_known;
  sum.num_known_edges = a.num_known_edges + b.num_known_edges;
  sum.seconds = a.seconds + b.seconds;
  return sum;
}

StageStatistics StagesStatistics::All() const {
  StageStatistics all;
  for (const StageStatistics& stage : stages_) all = all + stage;
  return all;
}

}  // namespace colmap_graphmatch
