#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/enum_words.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/graph/explorer.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/graph/retrieval.h"
#include "colmap_graphmatch/pipeline/budgeted_verifier.h"
#include "colmap_graphmatch/pipeline/image_ranking.h"
#include "colmap_graphmatch/pipeline/observer.h"
#include "colmap_graphmatch/pipeline/run_record.h"
#include "colmap_graphmatch/verification/batch_verifier.h"
#include "colmap_graphmatch/verification/colmap_verifier.h"
#include "colmap_graphmatch/verification/in_process.h"
#include "colmap_graphmatch/verification/options.h"
#include "colmap_graphmatch/verification/replay_verifier.h"

namespace colmap_graphmatch {

struct PipelineOptions {
  std::filesystem::path database_path;

  // Which pairs are tested. kGraphMatch: those that the loop finds. kSampling: the loop without
  // propagation. kPropagation: the loop with its first sampling alone. kRetrieval: the nearest
  // images of each. kBriad: the same and then num_expansions rounds of query expansion
  // (graph/retrieval.h). kExhaustive: all.
  enum class Strategy { kGraphMatch, kSampling, kPropagation, kRetrieval, kBriad, kExhaustive };
  Strategy strategy = Strategy::kGraphMatch;

  // Tests the pairs of this list (see pair_list.h) instead, unless it is empty.
  std::filesystem::path match_list_path;

  // Only the images of this list (see pair_list.h) look for partners, among all images, unless it
  // is empty: pairs of two others are not tested.
  std::filesystem::path image_list_path;

  // Leaves out pairs of images of one frame: what the cameras of a rig took at the same time.
  bool skip_image_pairs_in_same_frame = false;

  // A path, or a name to be found on PATH.
  std::string colmap_path = "colmap";

  // Where the shards are made; empty: $TMPDIR, or /tmp.
  std::filesystem::path work_path;

  // Cores to use at a time, COLMAP's included; -1: all. Takes the place of
  // verification.num_threads.
  int num_threads = -1;

  // Of everything random. The same seed, input and options give the same tested pairs.
  std::uint64_t seed = 0;

  // vectors.seed and vectors.gmm.seed are `seed`.
  ImageRankingOptions ranking;
  GraphMatchOptions graph;

  // Images that kRetrieval and kBriad retrieve for each; 0: 120, for kBriad 40, as in the paper.
  int num_retrieved_images = 0;
  int num_expansions = 4;
  VerificationOptions verification;

  // What the run may spend; then it ends as if it had been stopped.
  TestBudget budget;

  // Ranks the images and tests nothing: the result has the candidates. COLMAP is not run, and
  // nothing is written to the database.
  bool dry_run = false;

  // Whether the result has images, discovery, tested and images_without_edge, which reports and
  // exports are made of: some 20 bytes for each tested pair.
  bool keep_details = false;

  // Answers pairs from this finished matching graph (see finished_graph.h) instead of having COLMAP
  // verify them, unless it is empty. Nothing is written to the database, and what it knows of pairs
  // is not used.
  std::filesystem::path replay_path;

  // Writes every tested pair to this CSV file (see test_log.h), unless it is empty.
  std::filesystem::path test_log_path;

  // Throws OptionsError.
  void Check() const;
};

inline constexpr EnumWords<PipelineOptions::Strategy, 6> kStrategyWords = {
    {{PipelineOptions::Strategy::kGraphMatch, "graphmatch"},
     {PipelineOptions::Strategy::kSampling, "sampling"},
     {PipelineOptions::Strategy::kPropagation, "propagation"},
     {PipelineOptions::Strategy::kRetrieval, "retrieval"},
     {PipelineOptions::Strategy::kBriad, "briad"},
     {PipelineOptions::Strategy::kExhaustive, "exhaustive"}}};

// Two images that look alike.
struct CandidatePair {
  ImagePair pair;
  float distance = 0;  // Of the ranking.
};

struct PipelineResult {
  enum class StoppedBy { kNothing, kRequest, kMaxPairs, kMaxMinutes };

  std::size_t num_images = 0;
  std::size_t num_images_without_features = 0;
  bool listed = false;  // The pairs were given, all or a list: no sampling, no propagation.
  ExplorationResult matching;
  MatchingStatistics descriptor_matching;  // Without a replay:
  ColmapVerifier::Statistics colmap;       // what verification took,
  FitStatistics fits;                      // and the fits before or instead of it.
  int num_threads = 1;
  bool replayed = false;
  ImageRankingSeconds preprocessing_seconds;
  double matching_seconds = 0;  // Of the loop or the list, with verification.
  double modelled_seconds = 0;  // What verification would have taken that was replayed.
  double total_seconds = 0;

  StoppedBy stopped_by = StoppedBy::kNothing;
  // Of a run that was stopped: about how many tests were to come (LoopProgress); nothing if it
  // stopped before the first one.
  std::optional<std::size_t> num_expected_tests_left;

  // Of a dry run: the pairs that the strategy would draw for each image if none of them matched,
  // but for those tested already; nearest first.
  bool dry_run = false;
  std::vector<CandidatePair> candidates;
  std::size_t num_candidates_per_image = 0;

  // With PipelineOptions::keep_details:
  std::vector<ImageRecord> images;  // All, ascending by id; for candidates, too.
  std::vector<DiscoveryPoint> discovery;
  std::vector<VerifiedPair> tested;  // Those of earlier runs included; ascending.
  std::vector<ImageWithoutEdge> images_without_edge;
};

// The whole job: from the features in the database to its two-view geometries. Throws the errors of
// base/errors.h, StoppedError among them if stop was raised before the first pair; every shard that
// was verified until then is in the database.
PipelineResult RunPipeline(const PipelineOptions& options, const StopRequest& stop,
                           PipelineObserver& observer);

}  // namespace colmap_graphmatch
