#include "colmap_graphmatch/pipeline/options.h"

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/pipeline/strategy.h"

namespace colmap_graphmatch {

void TestBudget::Check() const {
  if (!(max_minutes >= 0)) throw OptionsError("max_minutes must be at least 0.");
}

bool PipelineOptions::RanksImages() const {
  if (!match_list_path.empty()) return false;
  switch (strategy) {
    case Strategy::kGraphMatch:
    case Strategy::kSampling:
    case Strategy::kPropagation:
    case Strategy::kRetrieval:
    case Strategy::kBriad:
    case Strategy::kBestFirst:
      return true;
    case Strategy::kExhaustive:
      break;
  }
  return false;
}

void PipelineOptions::Check() const {
  if (!match_list_path.empty() && strategy != PipelineOptions().strategy) {
    throw OptionsError(
        "--GraphMatching.match_list_path and --GraphMatching.strategy contradict each other: give "
        "one of them.");
  }
  if (!match_list_path.empty() && !image_list_path.empty()) {
    throw OptionsError(
        "--GraphMatching.match_list_path lists pairs, --VocabTreeMatching.match_list_path images "
        "that look for partners: give one of them.");
  }
  if (!RanksImages() && (!ranking.ranking_path.empty() || !ranking.export_path.empty() ||
                         !ranking.vectors.vectors_path.empty())) {
    throw OptionsError(
        "--GraphMatching.ranking_path, --GraphMatching.vectors_path and "
        "--GraphMatching.export_vectors need a strategy that ranks images; a list of pairs and the "
        "strategy exhaustive do not.");
  }
  EffectiveNumThreads(num_threads);
  if (num_retrieved_images < 0) {
    throw OptionsError("num_retrieved_images is " + std::to_string(num_retrieved_images) +
                       "; it must be positive, or 0 to have it chosen.");
  }
  RetrievalOptionsOf(*this).Check();
  budget.Check();
  ranking.Check();
  graph.Check();
  best_first.Check();
  verification.Check();
}

}  // namespace colmap_graphmatch
