#pragma once

#include <array>
#include <cstddef>

namespace colmap_graphmatch {

// Who proposed a pair. kSampling, kPropagation: the paper's loop; the first batch of best first is
// kSampling, too. kListed: the pairs were given beforehand, or are all. kRetrieval: the ranking,
// kExpansion: query expansion after it. kLikeliest: best first, by a model of what was tested
// before. kLast is another name of the last one.
enum class LoopStage {
  kSampling,
  kPropagation,
  kListed,
  kRetrieval,
  kExpansion,
  kLikeliest,
  kLast = kLikeliest
};

// All of them, in the order of the enumeration.
inline constexpr std::array<LoopStage, 6> kLoopStages = {
    LoopStage::kSampling,  LoopStage::kPropagation, LoopStage::kListed,
    LoopStage::kRetrieval, LoopStage::kExpansion,   LoopStage::kLikeliest};
static_assert(kLoopStages.size() == static_cast<std::size_t>(LoopStage::kLast) + 1 &&
                  kLoopStages.back() == LoopStage::kLast,
              "kLoopStages must have every LoopStage.");

// The lower-case word for a stage in logs and reports.
const char* StageName(LoopStage stage);

struct StageStatistics {
  std::size_t num_tested = 0;  // Pairs that the verifier tested in this run.
  std::size_t num_edges = 0;   // Those of them that passed.
  std::size_t num_failed = 0;  // Pairs that the verifier could not test.
  std::size_t num_known = 0;   // Pairs asked for that earlier runs had tested.
  std::size_t num_known_edges = 0;
  double seconds = 0;

  // Edges found / pairs tested, 0 without tests.
  double Efficiency() const {
    return num_tested == 0 ? 0 : static_cast<double>(num_edges) / static_cast<double>(num_tested);
  }
};

StageStatistics operator+(const StageStatistics& a, const StageStatistics& b);

// Of every stage.
class StagesStatistics {
 public:
  StageStatistics& operator[](LoopStage stage) {
    return stages_.at(static_cast<std::size_t>(stage));
  }
  const StageStatistics& operator[](LoopStage stage) const {
    return stages_.at(static_cast<std::size_t>(stage));
  }
  StageStatistics All() const;

 private:
  std::array<StageStatistics, kLoopStages.size()> stages_ = {};
};

struct IterationStatistics {
  int iteration = 0;  // Counted from 0; those without a test are left out.
  StagesStatistics stages;
};

}  // namespace colmap_graphmatch
