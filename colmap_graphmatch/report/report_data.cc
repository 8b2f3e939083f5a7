#include "colmap_graphmatch/report/report_data.h"

#include <algorithm>
#include <fstream>
#include <variant>

#include "colmap_graphmatch/report/matching_graph_view.h"

namespace colmap_graphmatch {
namespace {

// Parts of a model that are too small to be missed are not worth a place in a list.
constexpr std::size_t kMinPart = 2;
constexpr std::size_t kMinGroup = 3;

// Not from getrusage, which counts what the program was started from, too.
std::optional<double> PeakMemory() {
  const std::string key = "VmHWM:";
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key, 0) == 0) return std::stod(line.substr(key.size())) / 1024;
  }
  return std::nullopt;
}

std::string NameOfStrategy(const PipelineOptions& options) {
  return options.match_list_path.empty() ? WordOf(kStrategyWords, options.strategy) : "list";
}

std::string NameOfDescriptor(const ImageRankingOptions& options) {
  return options.ranking_path.empty() ? WordOf(kDescriptorWords, options.vectors.descriptor)
                                      : "lists";
}

std::optional<std::string> NameOf(PipelineResult::StoppedBy stopped_by) {
  switch (stopped_by) {
    case PipelineResult::StoppedBy::kRequest:
      return "signal";
    case PipelineResult::StoppedBy::kMaxPairs:
      return "max_pairs";
    case PipelineResult::StoppedBy::kMaxMinutes:
      return "max_minutes";
    case PipelineResult::StoppedBy::kNothing:
      break;
  }
  return std::nullopt;
}

// Whether the element at `place` of num_all belongs to an even sample of num_wanted.
bool IsInSample(std::size_t place, std::size_t num_all, std::size_t num_wanted) {
  return (place + 1) * num_wanted / num_all > place * num_wanted / num_all;
}

void SetNonedges(const std::vector<VerifiedPair>& tested, const ImageIndex& index,
                 ReportDetails* details) {
  const auto is_nonedge = [](const VerifiedPair& verified) {
    return verified.outcome == PairOutcome::kNoEdge;
  };
  const auto num_all =
      static_cast<std::size_t>(std::count_if(tested.begin(), tested.end(), is_nonedge));
  const std::size_t num_wanted = std::min(num_all, kMaxNonedges);
  details->nonedges.reserve(num_wanted);
  std::size_t place = 0;
  for (const VerifiedPair& verified : tested) {
    if (!is_nonedge(verified) || !IsInSample(place++, num_all, num_wanted)) continue;
    details->nonedges.emplace_back(index.Of(verified.pair.id1), index.Of(verified.pair.id2));
  }
  details->num_nonedges_left_out = num_all - num_wanted;
}

// The leading elements for which `keeps` holds, after sorting by `size`, greatest first.
template <typename T, typename Size>
std::vector<T> Greatest(std::vector<T> list, std::size_t minimum, const Size& size) {
  std::stable_sort(list.begin(), list.end(),
                   [&](const T& a, const T& b) { return size(a) > size(b); });
  list.erase(std::find_if(list.begin(), list.end(), [&](const T& t) { return size(t) < minimum; }),
             list.end());
  return list;
}

void SetCutPlaces(ReportDetails* details) {
  const CutPlaces places = FindCutPlaces(details->images.size(), details->edges);
  details->num_articulation_points = places.articulation_points.size();
  details->num_bridges = places.bridges.size();
  details->articulation_points =
      Greatest(places.articulation_points, kMinPart,
               [](const ArticulationPoint& point) { return point.parts[1]; });
  details->bridges = Greatest(places.bridges, kMinPart, [](const Bridge& bridge) {
    return std::min(bridge.sides[0], bridge.sides[1]);
  });
}

ReportDetails::ImageAlone WithPlaces(const ImageWithoutEdge& image, const ImageIndex& index) {
  ReportDetails::ImageAlone alone{index.Of(image.image), image.num_failed, {}};
  for (const ImageWithoutEdge::Candidate& candidate : image.candidates) {
    alone.candidates.push_back({index.Of(candidate.image), candidate.distance,
                                candidate.num_matches, candidate.num_inliers});
  }
  return alone;
}

ReportDetails MakeDetails(const PipelineOptions& options, const RunDetails& run) {
  const ImageIndex index(run.images);
  ReportDetails details;
  details.images = run.images;
  details.edges = EdgesOf(run, index);
  details.components = FindComponents(details.images.size(), details.edges);
  SetNonedges(run.tested, index, &details);
  details.discovery = run.discovery;
  SetCutPlaces(&details);
  const auto strong = static_cast<std::uint32_t>(2 * options.verification.geometry.min_num_inliers);
  details.weak_links = FindWeakLinks(details.images.size(), details.edges, strong, kMinGroup);
  for (const ImageWithoutEdge& image : run.images_without_edge) {
    details.images_without_edge.push_back(WithPlaces(image, index));
  }
  return details;
}

}  // namespace

ReportData MakeReportData(const PipelineOptions& options, const PipelineResult& result) {
  const ExplorationResult& matching = result.matching;
  ReportData data;
  data.finished = matching.finished;
  data.stopped_by = NameOf(result.stopped_by);
  data.num_expected_tests_left = result.num_expected_tests_left;
  data.strategy = NameOfStrategy(options);
  if (options.RanksImages()) data.descriptor = NameOfDescriptor(options.ranking);
  data.min_num_inliers = options.verification.geometry.min_num_inliers;
  data.num_threads = result.num_threads;
  data.peak_memory_mb = PeakMemory();
  data.num_images = result.num_images;
  data.num_images_without_features = result.num_images_without_features;
  data.num_images_without_edge = matching.num_isolated + result.num_images_without_features;
  data.num_tested = matching.graph.NumTested();
  data.num_edges = matching.graph.NumEdges();
  data.num_components = matching.num_components;
  data.largest_component = matching.largest_component;
  data.preprocessing_seconds = result.preprocessing_seconds;
  data.matching_seconds = result.matching_seconds;
  data.total_seconds = result.total_seconds;
  const auto* replay = std::get_if<ReplayCost>(&result.cost);
  if (replay != nullptr) data.modelled_seconds = replay->modelled_seconds;
  data.stages = matching.stages;
  data.iterations = matching.iterations;
  if (result.details) data.details = MakeDetails(options, *result.details);
  return data;
}

}  // namespace colmap_graphmatch
