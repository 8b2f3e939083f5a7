#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/base/verified_pair.h"
#include "colmap_graphmatch/graph/exploration.h"
#include "colmap_graphmatch/vectors/ranking_seconds.h"

namespace colmap_graphmatch {

// How far a run had come after a test.
struct DiscoveryPoint {
  LoopStage stage = LoopStage::kSampling;
  int iteration = 0;
  std::size_t num_tested = 0;  // By this run, and
  std::size_t num_edges = 0;   // the edges among them.
  double seconds = 0;          // Since the start of the run.
};

// An image that no other matched, and what came nearest to it.
struct ImageWithoutEdge {
  struct Candidate {
    ImageId image = 0;
    double distance = 0;  // Of the ranking; infinite without one.
    std::uint32_t num_inliers = 0;
    std::int32_t num_matches = -1;  // Negative: not known.
  };
  ImageId image = 0;
  std::vector<Candidate> candidates;  // The nearest tested images, nearest first.
  std::size_t num_failed = 0;         // Pairs with it on which the verifier failed.
};

// What is known of single images and pairs.
struct RunDetails {
  std::vector<ImageRecord> images;  // All, ascending by id.
  std::vector<DiscoveryPoint> discovery;
  std::vector<VerifiedPair> tested;  // Those of earlier runs included; ascending.
  std::vector<ImageWithoutEdge> images_without_edge;
};

// What verification took.
struct VerificationCost {
  double descriptor_matching_seconds = 0;  // CPU time here, summed over threads.
  std::size_t num_matched = 0;             // Pairs whose descriptors were matched here.
  std::size_t num_image_reads = 0;         // For that.
  double fit_seconds = 0;        // CPU time of fits before or instead of COLMAP, over threads.
  std::size_t num_fitted = 0;    // Pairs,
  std::size_t num_settled = 0;   // and those of them that COLMAP did not get.
  double colmap_seconds = 0;     // In which COLMAP ran, summed over processes.
  std::size_t num_verified = 0;  // Pairs, by COLMAP.
  std::size_t num_failed = 0;    // Pairs on which the geometric verification failed.
};

// What verification would have taken that was replayed.
struct ReplayCost {
  double modelled_seconds = 0;
};

struct PipelineResult {
  enum class StoppedBy { kNothing, kRequest, kMaxPairs, kMaxMinutes };

  std::size_t num_images = 0;
  std::size_t num_images_without_features = 0;
  int num_threads = 1;
  ExplorationResult matching;
  std::variant<VerificationCost, ReplayCost> cost;
  ImageRankingSeconds preprocessing_seconds;
  double matching_seconds = 0;  // Of the loop or the list, with verification.
  double total_seconds = 0;
  StoppedBy stopped_by = StoppedBy::kNothing;
  // About how many tests were to come after the last one (LoopProgress); nothing before the first.
  std::optional<std::size_t> num_expected_tests_left;
  std::optional<RunDetails> details;  // With PipelineOptions::keep_details.
};

// Two images that look alike.
struct CandidatePair {
  ImagePair pair;
  float distance = 0;  // Of the ranking.
};

// What a strategy would begin with.
struct CandidateList {
  std::size_t num_images_without_features = 0;
  std::vector<ImageRecord> images;   // All, ascending by id.
  std::size_t num_per_image = 0;     // Pairs that are drawn for each image.
  std::vector<CandidatePair> pairs;  // Nearest first.
  double total_seconds = 0;
};

}  // namespace colmap_graphmatch
