#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "colmap_graphmatch/base/enum_words.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/vectors/options.h"
#include "colmap_graphmatch/verification/options.h"

namespace colmap_graphmatch {

// What a run may spend on tests. 0: without a limit.
struct TestBudget {
  std::size_t max_pairs = 0;  // That this run tests; known ones cost nothing.
  double max_minutes = 0;     // Since the start of the run, after which nothing is tested.

  bool IsUnlimited() const { return max_pairs == 0 && max_minutes <= 0; }

  // Throws OptionsError.
  void Check() const;
};

struct PipelineOptions {
  std::filesystem::path database_path;

  // Which pairs are tested. kBestFirst: the likeliest ones next, as the tests before them say.
  // kGraphMatch: those that the paper's loop finds. kSampling: the loop without propagation.
  // kPropagation: the loop with its first sampling alone. kRetrieval: the nearest images of each.
  // kBriad: the same and then num_expansions rounds of query expansion. kExhaustive: all.
  // (pipeline/strategy.h says what makes a new one.)
  enum class Strategy {
    kGraphMatch,
    kSampling,
    kPropagation,
    kRetrieval,
    kBriad,
    kBestFirst,
    kExhaustive
  };
  Strategy strategy = Strategy::kBestFirst;

  // Tests the pairs of this list (docs/formats.md) instead, unless it is empty.
  std::filesystem::path match_list_path;

  // Only the images of this list (docs/formats.md) look for partners, among all images, unless
  // it is empty: pairs of two others are not tested.
  std::filesystem::path image_list_path;

  // Leaves out pairs of images of one frame: what the cameras of a rig took at the same time.
  bool skip_image_pairs_in_same_frame = false;

  // A path, or a name to be found on PATH.
  std::string colmap_path = "colmap";

  // Where the shards are made; empty: $TMPDIR, or /tmp.
  std::filesystem::path work_path;

  // Cores to use at a time, COLMAP's included; -1: all.
  int num_threads = -1;

  // Of everything random in this library. The same seed, input and options give the same tested
  // pairs. COLMAP's own seed is verification.colmap_options["default_random_seed"].
  std::uint64_t seed = 0;

  ImageRankingOptions ranking;

  // graph.restrictions has no effect: a run makes its own from image_list_path and
  // skip_image_pairs_in_same_frame.
  GraphMatchOptions graph;

  // best_first.restrictions: as graph.restrictions.
  BestFirstOptions best_first;

  // Images that kRetrieval and kBriad retrieve for each; 0: 120, for kBriad 40, as in the paper.
  int num_retrieved_images = 0;
  int num_expansions = 4;
  VerificationOptions verification;

  // What the run may spend; then it ends as if it had been stopped.
  TestBudget budget;

  // Whether the result has details, which reports and exports are made of: some 20 bytes for each
  // tested pair.
  bool keep_details = false;

  // Answers pairs from this finished matching graph (docs/formats.md) instead of having COLMAP
  // verify them, unless it is empty. Nothing is written to the database, and what it knows of pairs
  // is not used.
  std::filesystem::path replay_path;

  // Writes every tested pair to this CSV file (docs/formats.md), unless it is empty.
  std::filesystem::path pair_log_path;

  // Whether images are ranked: not where all pairs are tested, or those of a list.
  bool RanksImages() const;

  // Throws OptionsError.
  void Check() const;
};

inline constexpr EnumWords<PipelineOptions::Strategy, 7> kStrategyWords = {
    {{PipelineOptions::Strategy::kBestFirst, "best_first"},
     {PipelineOptions::Strategy::kGraphMatch, "graphmatch"},
     {PipelineOptions::Strategy::kSampling, "sampling"},
     {PipelineOptions::Strategy::kPropagation, "propagation"},
     {PipelineOptions::Strategy::kRetrieval, "retrieval"},
     {PipelineOptions::Strategy::kBriad, "briad"},
     {PipelineOptions::Strategy::kExhaustive, "exhaustive"}}};

}  // namespace colmap_graphmatch
