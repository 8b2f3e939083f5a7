#include "colmap_graphmatch/cli/console.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace colmap_graphmatch {
namespace {

constexpr std::chrono::milliseconds kTerminalInterval(100);
constexpr std::chrono::seconds kLogInterval(10);

std::size_t TerminalWidth(int descriptor) {
  struct winsize size = {};
  if (::ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return size.ws_col;
}

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
std::string FormatVerification(const VerifierStatistics& statistics) {
  std::string text;
  if (statistics.num_matched > 0) {
    text +=
        fmt::format("Exact matching     {} pairs in {} of CPU time, {:.3f} image reads a pair\n",
                    statistics.num_matched, FormatDuration(statistics.matching_seconds),
                    static_cast<double>(statistics.num_image_reads) /
                        static_cast<double>(statistics.num_matched));
  }
  if (statistics.num_preempted > 0) {
    text += fmt::format("Given up early     {} pairs\n", statistics.num_preempted);
  }
  const double both = statistics.matching_seconds + statistics.colmap_seconds;
  if (both > 0) {
    text += fmt::format(
        "COLMAP             {} pairs in {}, summed over its processes: {:.0f} % of {}\n",
        statistics.num_verified, FormatDuration(statistics.colmap_seconds),
        100 * statistics.colmap_seconds / both, "matching and verification");
  }
  return text;
}

std::string FormatImages(const PipelineResult& result) {
  std::string text = fmt::format("\nImages             {}", result.num_images);
  if (result.num_images_without_features > 0) {
    text += fmt::format(" ({} without features)", result.num_images_without_features);
  }
  return text + "\n";
}

std::string FormatDryRun(const PipelineResult& result) {
  std::string text = FormatImages(result);
  text += fmt::format(
      "Candidates         {} pairs that are not tested yet: each image with its {}\n",
      result.candidates.size(), fmt::format("{} nearest", result.num_candidates_per_image));
  text += "Dry run            nothing was tested, and nothing written to the database\n";
  text += fmt::format("Time               {}\n", FormatDuration(result.total_seconds));
  return text;
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
  return fmt::format("Stopped            {}; about {} more tests were to come\n", limit,
                     result.num_expected_tests_left);
}

}  // namespace

Console::Console(std::FILE* stream)
    : stream_(stream), is_terminal_(::isatty(::fileno(stream)) == 1) {}

Console::~Console() { ClearProgress(); }

void Console::Print(const std::string& text) {
  std::fputs(text.c_str(), stream_);
  std::fflush(stream_);
}

void Console::ClearProgress() {
  if (showing_progress_) Print("\n");
  showing_progress_ = false;
}

void Console::OnInfo(const std::string& message) {
  ClearProgress();
  Print(WithoutControlCharacters(message) + "\n");
}

void Console::OnWarning(const std::string& message) {
  ClearProgress();
  Print("Warning: " + WithoutControlCharacters(message) + "\n");
}

void Console::OnProgress(const LoopProgress& progress) {
  const Clock::time_point now = Clock::now();
  if (!matching_) {
    matching_ = true;
    start_of_matching_ = now;
    last_progress_ = now;
    return;
  }
  const Clock::duration interval = is_terminal_ ? Clock::duration(kTerminalInterval) : kLogInterval;
  if (now - last_progress_ < interval) return;
  last_progress_ = now;
  const std::string line =
      FormatProgress(progress, std::chrono::duration<double>(now - start_of_matching_).count());
  if (is_terminal_) {
    // One column is left free: a full line would wrap on some terminals.
    Print("\r\033[K" + line.substr(0, TerminalWidth(::fileno(stream_)) - 1));
    showing_progress_ = true;
  } else {
    Print(line + "\n");
  }
}

std::string WithoutControlCharacters(std::string text) {
  const auto is_control = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < ' ' && c != '\n' && c != '\t') || byte == 0x7F;
  };
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

std::string FormatDuration(double seconds) {
  if (seconds < 100) return fmt::format("{:.1f} s", seconds);
  if (seconds < 100 * 60) return fmt::format("{:.1f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

std::string FormatProgress(const LoopProgress& progress, double seconds_of_matching) {
  const StageStatistics& all = progress.all;
  static const std::map<LoopStage, const char*> kNames = {
      {LoopStage::kSampling, "sampling"},   {LoopStage::kPropagation, "propagation"},
      {LoopStage::kListed, "matching"},     {LoopStage::kRetrieval, "retrieval"},
      {LoopStage::kExpansion, "expansion"},
  };
  std::string line = kNames.at(progress.stage);
  const bool repeats =
      progress.stage != LoopStage::kListed && progress.stage != LoopStage::kRetrieval;
  if (repeats) line += fmt::format(" {}", progress.iteration + 1);
  line += fmt::format(": {} tested", all.num_tested);
  if (all.num_tested > 0 && seconds_of_matching > 1) {
    const double rate = static_cast<double>(all.num_tested) / seconds_of_matching;
    line += fmt::format(
        ", {:.1f}/s, about {} left", rate,
        FormatDuration(std::ceil(static_cast<double>(progress.expected_remaining_tests) / rate)));
  }
  // The most important first: a terminal cuts off what it has no room for.
  line += fmt::format("; {} edges in all, components {}, largest {}, without an edge {}",
                      progress.num_edges, progress.num_components, progress.largest_component,
                      progress.num_isolated);
  return line;
}

std::string FormatSummary(const PipelineOptions& options, const PipelineResult& result) {
  if (result.dry_run) return FormatDryRun(result);
  const GraphMatchResult& matching = result.matching;
  const auto num_images =
      static_cast<double>(result.num_images - result.num_images_without_features);
  const double num_possible = num_images * (num_images - 1) / 2;
  const StageStatistics all = matching.All();
  const bool listed = result.listed;

  std::string text = FormatImages(result);
  text += fmt::format("Pairs tested       {} of {:.0f} possible ({:.2f} %)\n", all.num_tested,
                      num_possible, Share(all.num_tested, num_possible));
  if (matching.num_seed_pairs > 0) {
    text += fmt::format("Already there      {} pairs{}, {} edges\n", matching.num_seed_pairs,
                        listed ? " that are not listed" : "", matching.num_seed_edges);
  }
  for (const auto& [name, stage] : {std::make_pair("sampling", matching.sampling),
                                    std::make_pair("propagation", matching.propagation),
                                    std::make_pair("retrieval", matching.retrieval),
                                    std::make_pair("expansion", matching.expansion)}) {
    if (stage.num_tested + stage.num_failed + stage.num_known > 0) text += FormatStage(name, stage);
  }
  text += FormatStage("all", all);
  if (all.num_tested + all.num_failed == 0 && matching.finished) {
    text +=
        "  Nothing is left to test: all pairs that these options ask for were tested before, "
        "perhaps "
        "with other\n  options of matching. To match anew: colmap database_cleaner --type matches "
        "--database_path DATABASE\n";
  }
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
  text += FormatVerification(result.verification);
  if (result.replayed) {
    text += fmt::format("Replayed           matching and verification would have taken some {}\n",
                        FormatDuration(result.modelled_seconds));
  }
  text += fmt::format("Time               {}", FormatDuration(result.total_seconds));
  if (!listed) {
    const ImageRankingSeconds& seconds = result.preprocessing_seconds;
    text += " (";
    if (seconds.mixture > 0) text += fmt::format("mixture {}, ", FormatDuration(seconds.mixture));
    if (options.ranking.ranking_path.empty()) {
      text += fmt::format("{} {}, ", NameOfVectors(options.ranking.vectors.descriptor),
                          FormatDuration(seconds.vectors));
    }
    text += fmt::format("ranking {}, matching {})", FormatDuration(seconds.ranking),
                        FormatDuration(result.matching_seconds));
  }
  text += '\n';
  return text;
}

}  // namespace colmap_graphmatch
