#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/base/verified_pair.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/stages.h"

namespace colmap_graphmatch {

// Where a run is after a pair was verified.
struct LoopProgress {
  LoopStage stage = LoopStage::kSampling;
  int iteration = 0;
  VerifiedPair last;          // The pair.
  StageStatistics all;        // Of all stages together.
  std::size_t num_edges = 0;  // Of the whole graph, those of earlier runs included.
  std::size_t num_components = 0;
  std::size_t largest_component = 0;
  std::size_t num_isolated = 0;
  // An estimate of the tests to come (docs/benchmarks.md says how good it is).
  std::size_t expected_remaining_tests = 0;
  std::size_t expected_remaining_samples = 0;  // Those of them that sampling draws.
};

using OnProgress = std::function<void(const LoopProgress&)>;

// What a run found.
struct ExplorationResult {
  MatchingGraph graph{0};
  StagesStatistics stages;
  std::vector<IterationStatistics> iterations;  // Of the paper's loop.
  // Pairs that were in the database before the run and that the proposer did not ask for itself.
  std::size_t num_seed_pairs = 0;
  std::size_t num_seed_edges = 0;
  std::size_t num_components = 0;
  std::size_t largest_component = 0;
  std::size_t num_isolated = 0;
  std::vector<ImagePair> failed_pairs;
  bool finished = true;  // False if the verifier was asked to stop.
};

}  // namespace colmap_graphmatch
