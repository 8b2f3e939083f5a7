#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/pipeline/options.h"
#include "colmap_graphmatch/pipeline/result.h"
#include "colmap_graphmatch/report/graph_analysis.h"

namespace colmap_graphmatch {

// What is known of single images and pairs. All members count images by their places in `images`.
struct ReportDetails {
  struct Candidate {
    std::size_t image = 0;
    double distance = 0;            // Of the ranking; infinite without one.
    std::int32_t num_matches = -1;  // Negative: not known.
    std::uint32_t num_inliers = 0;
  };
  struct ImageAlone {
    std::size_t image = 0;
    std::size_t num_failed = 0;  // Pairs with it on which the verifier failed.
    std::vector<Candidate> candidates;
  };

  std::vector<ImageRecord> images;                   // Ascending by id.
  std::vector<std::vector<std::size_t>> components;  // As FindComponents returns them.
  std::vector<GraphEdge> edges;                      // Ascending.

  // Pairs that were tested and are no edges, ascending; an even sample if there are more than
  // kMaxNonedges.
  std::vector<std::pair<std::size_t, std::size_t>> nonedges;
  std::size_t num_nonedges_left_out = 0;

  std::vector<DiscoveryPoint> discovery;

  // How many there are; the lists have those that cut off two images or more, worst first.
  std::size_t num_articulation_points = 0;
  std::size_t num_bridges = 0;
  std::vector<ArticulationPoint> articulation_points;
  std::vector<Bridge> bridges;
  std::vector<WeakLink> weak_links;

  std::vector<ImageAlone> images_without_edge;
};

// A file with more would be too large to open.
inline constexpr std::size_t kMaxNonedges = 500000;

// All that a report says of a run: what was found and what it cost. Everything in report/ that
// writes or shows a report reads this.
struct ReportData {
  bool finished = true;
  std::optional<std::string> stopped_by;  // "signal", "max_pairs" or "max_minutes".
  std::optional<std::size_t> num_expected_tests_left;
  std::string strategy;
  std::optional<std::string> descriptor;  // Nothing if the pairs were given.
  int min_num_inliers = 0;
  int num_threads = 1;
  std::optional<double> peak_memory_mb;  // Of this process; nothing if the system does not tell.

  std::size_t num_images = 0;
  std::size_t num_images_without_features = 0;
  std::size_t num_images_without_edge = 0;  // Those without features included.
  std::size_t num_tested = 0;               // With earlier runs.
  std::size_t num_edges = 0;
  std::size_t num_components = 0;  // Of two images or more.
  std::size_t largest_component = 0;

  ImageRankingSeconds preprocessing_seconds;
  double matching_seconds = 0;
  double total_seconds = 0;
  std::optional<double> modelled_seconds;  // Of a replay alone.

  StagesStatistics stages;
  std::vector<IterationStatistics> iterations;  // Of the paper's loop.

  std::optional<ReportDetails> details;  // With PipelineOptions::keep_details.
};

ReportData MakeReportData(const PipelineOptions& options, const PipelineResult& result);

}  // namespace colmap_graphmatch
