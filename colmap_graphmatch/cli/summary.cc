#include "colmap_graphmatch/cli/summary.h"

#include <fmt/format.h>

#include <variant>

#include "colmap_graphmatch/cli/progress.h"
#include "colmap_graphmatch/vectors/options.h"

namespace colmap_graphmatch {
namespace {

double Share(std::size_t part, double whole) {
  return whole > 0 ? 100 * static_cast<double>(part) / whole : 0;
}

std::string FormatStage(const char* name, const StageStatistics& stage) {
  const std::string efficiency =
      stage.num_tested > 0 ? fmt::format("{:.3f}", stage.Efficiency()) : "-";
  std::string line =
      fmt::format("  {:<12} {:>9} tested {:>9} edges   efficiency {:<5} {:>12}", name,
                  stage.num_tested, stage.num_edges, efficiency, FormatDuration(stage.seconds));
  if (stage.num_known > 0) {
    line +=
        fmt::format("   ({} more were known, {} edges)", stage.num_known, stage.num_known_edges);
  }
  return line + "\n";
}

// Where the time of matching went.
std::string FormatCost(const VerificationCost& cost) {
  std::string text;
  if (cost.num_matched > 0) {
    text += fmt::format(
        "Exact matching     {} pairs in {} of CPU time, {:.3f} image reads a pair\n",
        cost.num_matched, FormatDuration(cost.descriptor_matching_seconds),
        static_cast<double>(cost.num_image_reads) / static_cast<double>(cost.num_matched));
  }
  if (cost.num_fitted > 0) {
    text +=
        fmt::format("Fits               {} pairs in {} of CPU time, {} settled without COLMAP\n",
                    cost.num_fitted, FormatDuration(cost.fit_seconds), cost.num_settled);
  }
  const double all = cost.descriptor_matching_seconds + cost.fit_seconds + cost.colmap_seconds;
  const bool is_native = cost.num_fitted > 0 && cost.colmap_seconds == 0;
  if (all > 0 && !is_native) {
    text += fmt::format(
        "COLMAP             {} pairs in {}, summed over its processes: {:.0f} % of {}\n",
        cost.num_verified, FormatDuration(cost.colmap_seconds), 100 * cost.colmap_seconds / all,
        "matching and verification");
  }
  return text;
}

std::string FormatCost(const ReplayCost& cost) {
  return fmt::format("Replayed           matching and verification would have taken some {}\n",
                     FormatDuration(cost.modelled_seconds));
}

std::string FormatImages(std::size_t num_images, std::size_t num_without_features) {
  std::string text = fmt::format("\nImages             {}", num_images);
  if (num_without_features > 0) {
    text += fmt::format(" ({} without features)", num_without_features);
  }
  return text + "\n";
}

std::string FormatStoppedBy(const PipelineOptions& options, const PipelineResult& result) {
  std::string limit;
  switch (result.stopped_by) {
    case PipelineResult::StoppedBy::kNothing:
      return "";
    case PipelineResult::StoppedBy::kRequest:
      limit = "as asked";
      break;
    case PipelineResult::StoppedBy::kMaxPairs:
      limit = fmt::format("after max_pairs = {}", options.budget.max_pairs);
      break;
    case PipelineResult::StoppedBy::kMaxMinutes:
      limit = fmt::format("by max_minutes = {:g}", options.budget.max_minutes);
      break;
  }
  const std::string left =
      result.num_expected_tests_left
          ? fmt::format("about {} more tests were to come", *result.num_expected_tests_left)
          : std::string("before the first test");
  return fmt::format("Stopped            {}; {}\n", limit, left);
}

std::string FormatTests(const PipelineOptions& options, const PipelineResult& result) {
  const ExplorationResult& matching = result.matching;
  const StageStatistics all = matching.stages.All();
  const auto num_images =
      static_cast<double>(result.num_images - result.num_images_without_features);
  const double num_possible = num_images * (num_images - 1) / 2;
  std::string text = fmt::format("Pairs tested       {} of {:.0f} possible ({:.2f} %)\n",
                                 all.num_tested, num_possible, Share(all.num_tested, num_possible));
  if (matching.num_seed_pairs > 0) {
    text +=
        fmt::format("Already there      {} pairs{}, {} edges\n", matching.num_seed_pairs,
                    options.RanksImages() ? "" : " that are not listed", matching.num_seed_edges);
  }
  for (const LoopStage stage : kLoopStages) {
    const StageStatistics& statistics = matching.stages[stage];
    const bool asked = statistics.num_tested + statistics.num_failed + statistics.num_known > 0;
    // Where pairs are listed, that is the line for all.
    if (asked && stage != LoopStage::kListed) text += FormatStage(StageName(stage), statistics);
  }
  text += FormatStage("all", all);
  if (all.num_tested + all.num_failed == 0 && matching.finished) {
    text +=
        "  Nothing is left to test: all pairs that these options ask for were tested before, "
        "perhaps with other\n  options of matching. To match anew: colmap database_cleaner --type "
        "matches --database_path DATABASE\n";
  }
  return text;
}

std::string FormatTime(const PipelineOptions& options, const PipelineResult& result) {
  std::string text = fmt::format("Time               {}", FormatDuration(result.total_seconds));
  if (!options.RanksImages()) return text + "\n";
  const ImageRankingSeconds& seconds = result.preprocessing_seconds;
  text += " (";
  if (seconds.mixture > 0) {
    text += fmt::format("{} {}, ", NameOfModel(options.ranking.vectors.descriptor),
                        FormatDuration(seconds.mixture));
  }
  if (options.ranking.ranking_path.empty()) {
    text += fmt::format("{} {}, ", NameOfVectors(options.ranking.vectors.descriptor),
                        FormatDuration(seconds.vectors));
  }
  return text + fmt::format("ranking {}, matching {})\n", FormatDuration(seconds.ranking),
                            FormatDuration(result.matching_seconds));
}

}  // namespace

std::string FormatSummary(const PipelineOptions& options, const PipelineResult& result) {
  const ExplorationResult& matching = result.matching;
  std::string text = FormatImages(result.num_images, result.num_images_without_features) +
                     FormatTests(options, result);
  text +=
      fmt::format("Matching graph     {} edges, {} components, the largest of {} images\n",
                  matching.graph.NumEdges(), matching.num_components, matching.largest_component);
  text += fmt::format("Without an edge    {} images\n",
                      matching.num_isolated + result.num_images_without_features);
  text += FormatStoppedBy(options, result);
  if (!matching.failed_pairs.empty()) {
    text += fmt::format("Failed             {} pairs, see the warnings; they stay untested\n",
                        matching.failed_pairs.size());
  }
  text += std::visit([](const auto& cost) { return FormatCost(cost); }, result.cost);
  return text + FormatTime(options, result);
}

std::string FormatSummary(const CandidateList& candidates) {
  std::string text = FormatImages(candidates.images.size(), candidates.num_images_without_features);
  text += fmt::format(
      "Candidates         {} pairs that are not tested yet: each image with its {} nearest\n",
      candidates.pairs.size(), candidates.num_per_image);
  text += "Dry run            nothing was tested, and nothing written to the database\n";
  text += fmt::format("Time               {}\n", FormatDuration(candidates.total_seconds));
  return text;
}

}  // namespace colmap_graphmatch
