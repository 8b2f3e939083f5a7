#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// kSampling, kPropagation: of the loop. kListed: the pairs were given beforehand (listed_pairs.h).
// kRetrieval, kExpansion: see retrieval.h.
enum class LoopStage { kSampling, kPropagation, kListed, kRetrieval, kExpansion };

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

struct IterationStatistics {
  int iteration = 0;  // Counted from 0; those without a test are left out.
  StageStatistics sampling;
  StageStatistics propagation;
};

// The state of the loop after a pair was verified.
struct LoopProgress {
  LoopStage stage = LoopStage::kSampling;
  int iteration = 0;
  VerifiedPair last;           // The pair,
  bool last_is_known = false;  // which an earlier run had tested.
  StageStatistics all;         // Of all stages together.
  std::size_t num_edges = 0;   // Of the whole graph, those of earlier runs included.
  std::size_t num_components = 0;
  std::size_t largest_component = 0;
  std::size_t num_isolated = 0;
  // An estimate of the tests to come. In the loop: sampling goes on at its pace, and propagation
  // tests what it could propose now and what the edges among that lead to (docs/benchmarks.md says
  // how good it is).
  std::size_t expected_remaining_tests = 0;
  std::size_t expected_remaining_samples = 0;  // Those of them that sampling draws.
};

struct GraphMatchResult {
  MatchingGraph graph{0};
  std::vector<IterationStatistics> iterations;
  StageStatistics sampling;
  StageStatistics propagation;
  StageStatistics listed;
  StageStatistics retrieval;
  StageStatistics expansion;
  // Pairs that were in the database before the run and that the loop did not ask for itself.
  std::size_t num_seed_pairs = 0;
  std::size_t num_seed_edges = 0;
  std::size_t num_components = 0;
  std::size_t largest_component = 0;
  std::size_t num_isolated = 0;
  std::vector<ImagePair> failed_pairs;
  bool finished = true;  // False if the verifier was asked to stop.

  StageStatistics All() const { return sampling + propagation + listed + retrieval + expansion; }
};

// Finds out which known pairs have to be part of the graph from the start, so that what earlier
// runs did is gone on with (docs/design.md); ascending. Known pairs that are no seeds are answered
// from what is known in the places where an undisturbed run would have tested them; so a run that
// goes on after an interruption follows the path of the first and tests what is missing. If the
// loop, started from the earlier seeds (those of the run that may have been interrupted; ascending)
// or from none, asks for everything that is known, these are the seeds. Otherwise another matcher
// tested pairs, or images were added, and all known pairs are.
std::vector<ImagePair> ChooseSeeds(const GraphMatchOptions& options, const Ranking& ranking,
                                   const std::vector<ImageId>& image_ids,
                                   const PairVerifier& verifier, ThreadPool& threads,
                                   const std::vector<ImagePair>& earlier_seeds);

// The sample-and-propagate loop (GraphMatch, section 3; the pseudo-code is in docs/design.md).
// image_ids gives the image of every vertex of the ranking, ascending. Known pairs that are neither
// seeds nor asked for join the graph when nothing else is left to test.
//
// The tested pairs depend on the options, the ranking and the verifier's answers alone. Exceptions
// of the verifier pass through.
GraphMatchResult RunGraphMatch(const GraphMatchOptions& options, const Ranking& ranking,
                               const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                               ThreadPool& threads,
                               const std::function<void(const LoopProgress&)>& on_progress,
                               const std::vector<ImagePair>& seeds);

// The same with the seeds that ChooseSeeds finds without earlier ones.
GraphMatchResult RunGraphMatch(const GraphMatchOptions& options, const Ranking& ranking,
                               const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                               ThreadPool& threads,
                               const std::function<void(const LoopProgress&)>& on_progress);

}  // namespace colmap_graphmatch
