#include "colmap_graphmatch/report/json_report.h"

#include <algorithm>
#include <boost/algorithm/string/case_conv.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "colmap_graphmatch/base/version.h"
#include "colmap_graphmatch/report/graph_analysis.h"
#include "colmap_graphmatch/report/matching_graph_view.h"

namespace colmap_graphmatch {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kSchema[] = "graphmatch-report";

Json Stage(const StageStatistics& stage) {
  return {{"tested", stage.num_tested},           {"edges", stage.num_edges},
          {"failed", stage.num_failed},           {"known", stage.num_known},
          {"known_edges", stage.num_known_edges}, {"seconds", stage.seconds}};
}

// Parts of a model that are too small to be missed are not worth a place in a list.
constexpr std::size_t kMinPart = 2;
constexpr std::size_t kMinGroup = 3;

// The most memory that this process has had at a time, in MB; null where the system does not tell.
// (Not from getrusage, which counts what the program was started from, too.)
Json PeakMemory() {
  const std::string key = "VmHWM:";
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key, 0) == 0) return std::stod(line.substr(key.size())) / 1024;
  }
  return nullptr;
}

const char* Name(const PipelineOptions& options) {
  if (!options.match_list_path.empty()) return "list";
  switch (options.strategy) {
    case PipelineOptions::Strategy::kGraphMatch:
      return "graphmatch";
    case PipelineOptions::Strategy::kSampling:
      return "sampling";
    case PipelineOptions::Strategy::kPropagation:
      return "propagation";
    case PipelineOptions::Strategy::kRetrieval:
      return "retrieval";
    case PipelineOptions::Strategy::kBriad:
      return "briad";
    case PipelineOptions::Strategy::kExhaustive:
      break;
  }
  return "exhaustive";
}

const char* DescriptorName(const ImageRankingOptions& options) {
  if (!options.ranking_path.empty()) return "lists";
  switch (options.vectors.descriptor) {
    case ImageVectorOptions::Descriptor::kFisher:
      return "fisher";
    case ImageVectorOptions::Descriptor::kVlad:
      return "vlad";
    case ImageVectorOptions::Descriptor::kGist:
      return "gist";
    case ImageVectorOptions::Descriptor::kFile:
      break;
  }
  return "file";
}

Json StoppedBy(PipelineResult::StoppedBy stopped_by) {
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
  return nullptr;
}

// Numbers that cannot be written in JSON become null.
Json Finite(double number) { return std::isfinite(number) ? Json(number) : Json(nullptr); }

Json EdgeEntry(const GraphEdge& edge) { return {edge.a, edge.b, edge.num_inliers}; }

void AddCutPlaces(std::size_t num_images, const std::vector<GraphEdge>& edges, Json* report) {
  CutPlaces places = FindCutPlaces(num_images, edges);
  auto& points = places.articulation_points;
  auto& bridges = places.bridges;
  (*report)["num_articulation_points"] = points.size();
  (*report)["num_bridges"] = bridges.size();

  const auto smaller_side = [](const Bridge& bridge) {
    return std::min(bridge.sides[0], bridge.sides[1]);
  };
  std::stable_sort(points.begin(), points.end(),
                   [](const auto& a, const auto& b) { return a.parts[1] > b.parts[1]; });
  std::stable_sort(bridges.begin(), bridges.end(),
                   [&](const auto& a, const auto& b) { return smaller_side(a) > smaller_side(b); });
  (*report)["articulation_points"] = Json::array();
  for (const ArticulationPoint& point : points) {
    if (point.parts[1] < kMinPart) break;
    (*report)["articulation_points"].push_back({{"image", point.vertex}, {"parts", point.parts}});
  }
  (*report)["bridges"] = Json::array();
  for (const Bridge& bridge : bridges) {
    if (smaller_side(bridge) < kMinPart) break;
    const GraphEdge& edge = edges[bridge.edge];
    (*report)["bridges"].push_back({{"images", {edge.a, edge.b}},
                                    {"inliers", edge.num_inliers},
                                    {"sides", {bridge.sides[0], bridge.sides[1]}}});
  }
}

// What is known of single images and pairs.
void AddDetails(const PipelineOptions& options, const PipelineResult& result, Json* report) {
  const std::size_t num_images = result.images.size();
  const ImageIndex index(result.images);
  const std::vector<GraphEdge> edges = EdgesOf(result, index);

  Json names = Json::array();
  Json ids = Json::array();
  Json num_features = Json::array();
  for (const ImageRecord& image : result.images) {
    names.push_back(image.name);
    ids.push_back(image.id);
    num_features.push_back(image.num_features);
  }
  (*report)["image_names"] = std::move(names);
  (*report)["image_ids"] = std::move(ids);
  (*report)["num_features"] = std::move(num_features);
  (*report)["connected_components"] = FindComponents(num_images, edges);
  Json edge_list = Json::array();
  for (const GraphEdge& edge : edges) edge_list.push_back(EdgeEntry(edge));
  (*report)["edge_list"] = std::move(edge_list);
  Json nonedge_list = Json::array();
  for (const VerifiedPair& verified : result.tested) {
    if (verified.outcome != PairOutcome::kNoEdge) continue;
    nonedge_list.push_back(index.Of(verified.pair.id1));
    nonedge_list.push_back(index.Of(verified.pair.id2));
  }
  (*report)["nonedge_list"] = std::move(nonedge_list);

  (*report)["discovery"] = Json::array();
  for (const DiscoveryPoint& point : result.discovery) {
    (*report)["discovery"].push_back({{"stage", StageName(point.stage)},
                                      {"iteration", point.iteration},
                                      {"tests", point.num_tested},
                                      {"edges", point.num_edges},
                                      {"seconds", point.seconds}});
  }

  AddCutPlaces(num_images, edges, report);
  (*report)["weak_links"] = Json::array();
  const auto strong = static_cast<std::uint32_t>(2 * options.verification.min_num_inliers);
  for (const WeakLink& link : FindWeakLinks(num_images, edges, strong, kMinGroup)) {
    Json edges_of_link = Json::array();
    for (const std::size_t edge : link.edges) edges_of_link.push_back(EdgeEntry(edges[edge]));
    (*report)["weak_links"].push_back(
        {{"groups", {link.groups[0], link.groups[1]}}, {"edges", std::move(edges_of_link)}});
  }

  (*report)["images_without_edge"] = Json::array();
  for (const ImageWithoutEdge& image : result.images_without_edge) {
    Json candidates = Json::array();
    for (const ImageWithoutEdge::Candidate& candidate : image.candidates) {
      candidates.push_back(
          {{"image", index.Of(candidate.image)},
           {"distance", Finite(candidate.distance)},
           {"matches", candidate.num_matches < 0 ? Json(nullptr) : Json(candidate.num_matches)},
           {"inliers", candidate.num_inliers}});
    }
    const std::size_t place = index.Of(image.image);
    (*report)["images_without_edge"].push_back({{"image", place},
                                                {"features", result.images[place].num_features},
                                                {"failed", image.num_failed},
                                                {"candidates", std::move(candidates)}});
  }
}

// A member a line: readable where it is short, and not a line for every number of a long list.
std::string Dump(const Json& report) {
  std::string text = "{\n";
  for (auto member = report.begin(); member != report.end(); ++member) {
    if (member != report.begin()) text += ",\n";
    // Names of images are bytes, and need not be UTF-8, which JSON has to be.
    text += "  " + Json(member.key()).dump() + ": " +
            member.value().dump(-1, ' ', false, Json::error_handler_t::replace);
  }
  return text + "\n}\n";
}

}  // namespace

std::string MakeJsonReport(const PipelineOptions& options, const PipelineResult& result) {
  const ExplorationResult& matching = result.matching;
  Json report;
  report["schema"] = kSchema;
  report["version"] = 1;
  report["program"] = std::string("graphmatch_matcher ") + kVersion;
  report["replay"] = result.replayed;
  report["finished"] = matching.finished;
  report["stopped_by"] = StoppedBy(result.stopped_by);
  if (!matching.finished) {
    const auto& left = result.num_expected_tests_left;
    report["expected_tests_left"] = left ? Json(*left) : Json(nullptr);
  }
  report["strategy"] = Name(options);
  if (!result.listed) {
    report["descriptor"] = DescriptorName(options.ranking);
  }
  report["min_num_inliers"] = options.verification.min_num_inliers;
  report["threads"] = result.num_threads;
  report["peak_memory_mb"] = PeakMemory();
  report["images"] = {{"total", result.num_images},
                      {"without_features", result.num_images_without_features},
                      {"isolated", matching.num_isolated + result.num_images_without_features}};
  report["graph"] = {{"tested", matching.graph.NumTested()},
                     {"edges", matching.graph.NumEdges()},
                     {"components", matching.num_components},
                     {"largest_component", matching.largest_component}};
  report["seconds"] = {{"mixture", result.preprocessing_seconds.mixture},
                       {"vectors", result.preprocessing_seconds.vectors},
                       {"ranking", result.preprocessing_seconds.ranking},
                       {"matching", result.matching_seconds},
                       {"total", result.total_seconds}};
  if (result.replayed) report["seconds"]["modelled"] = result.modelled_seconds;
  report["stages"] = Json::object();
  for (const LoopStage stage : kLoopStages) {
    report["stages"][StageName(stage)] = Stage(matching.stages[stage]);
  }
  report["iterations"] = Json::array();
  for (const IterationStatistics& iteration : matching.iterations) {
    report["iterations"].push_back(
        {{"iteration", iteration.iteration},
         {"sampling", Stage(iteration.stages[LoopStage::kSampling])},
         {"propagation", Stage(iteration.stages[LoopStage::kPropagation])}});
  }
  if (options.keep_details) AddDetails(options, result, &report);
  return Dump(report);
}

bool IsPage(const std::filesystem::path& report_path) {
  const std::string ending = boost::algorithm::to_lower_copy(report_path.extension().string());
  return ending == ".html" || ending == ".htm";
}

std::filesystem::path JsonReportPath(std::filesystem::path report_path) {
  return IsPage(report_path) ? report_path.replace_extension(".json") : report_path;
}

bool IsJsonReport(const std::filesystem::path& path) {
  // The schema is its first member.
  std::string beginning(64, '\0');
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;
  std::ifstream(path, std::ios::binary)
      .read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  return beginning.find(kSchema) != std::string::npos;
}

}  // namespace colmap_graphmatch
