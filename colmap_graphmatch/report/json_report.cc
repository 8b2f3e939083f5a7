#include "colmap_graphmatch/report/json_report.h"

#include <boost/algorithm/string/case_conv.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <vector>

#include "colmap_graphmatch/base/version.h"

namespace colmap_graphmatch {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kSchema[] = "graphmatch-report";

// The members of an object, a line each: readable where they are short, and not a line for every
// number of a long list.
class Members {
 public:
  void Add(const std::string& name, const Json& value) {
    text_ += text_.empty() ? "{\n" : ",\n";
    // Names of images are bytes, and need not be UTF-8, which JSON has to be.
    text_ += "  " + Json(name).dump() + ": " +
             value.dump(-1, ' ', false, Json::error_handler_t::replace);
  }

  std::string Object() const { return text_ + "\n}\n"; }

 private:
  std::string text_;
};

template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// Numbers that cannot be written in JSON become null.
Json Finite(double number) { return std::isfinite(number) ? Json(number) : Json(nullptr); }

// An array of what a function makes of each element.
template <typename T, typename Function>
Json ArrayOf(const std::vector<T>& list, const Function& entry) {
  Json array = Json::array();
  for (const T& element : list) array.push_back(entry(element));
  return array;
}

Json Stage(const StageStatistics& stage) {
  return {{"tested", stage.num_tested},           {"edges", stage.num_edges},
          {"failed", stage.num_failed},           {"known", stage.num_known},
          {"known_edges", stage.num_known_edges}, {"seconds", stage.seconds}};
}

Json EdgeEntry(const GraphEdge& edge) { return {edge.a, edge.b, edge.num_inliers}; }

Json CandidateEntry(const ReportDetails::Candidate& candidate) {
  return {{"image", candidate.image},
          {"distance", Finite(candidate.distance)},
          {"matches", candidate.num_matches < 0 ? Json(nullptr) : Json(candidate.num_matches)},
          {"inliers", candidate.num_inliers}};
}

void AddGraph(const ReportDetails& details, Members* members) {
  members->Add("image_names",
               ArrayOf(details.images, [](const ImageRecord& image) { return image.name; }));
  members->Add("image_ids",
               ArrayOf(details.images, [](const ImageRecord& image) { return image.id; }));
  members->Add("num_features", ArrayOf(details.images, [](const ImageRecord& image) {
                 return image.num_features;
               }));
  members->Add("connected_components", details.components);
  members->Add("edge_list", ArrayOf(details.edges, EdgeEntry));
  Json nonedges = Json::array();
  for (const auto& [a, b] : details.nonedges) {
    nonedges.push_back(a);
    nonedges.push_back(b);
  }
  members->Add("nonedge_list", nonedges);
  members->Add("nonedges_left_out", details.num_nonedges_left_out);
}

void AddWeakPlaces(const ReportDetails& details, Members* members) {
  const std::vector<GraphEdge>& edges = details.edges;
  members->Add("num_articulation_points", details.num_articulation_points);
  members->Add("num_bridges", details.num_bridges);
  members->Add("articulation_points",
               ArrayOf(details.articulation_points, [](const ArticulationPoint& point) {
                 return Json{{"image", point.vertex}, {"parts", point.parts}};
               }));
  members->Add("bridges", ArrayOf(details.bridges, [&](const Bridge& bridge) {
                 const GraphEdge& edge = edges[bridge.edge];
                 return Json{{"images", {edge.a, edge.b}},
                             {"inliers", edge.num_inliers},
                             {"sides", bridge.sides}};
               }));
  members->Add("weak_links", ArrayOf(details.weak_links, [&](const WeakLink& link) {
                 return Json{{"groups", link.groups},
                             {"edges", ArrayOf(link.edges, [&](std::size_t edge) {
                                return EdgeEntry(edges[edge]);
                              })}};
               }));
}

void AddDetails(const ReportDetails& details, Members* members) {
  AddGraph(details, members);
  members->Add("discovery", ArrayOf(details.discovery, [](const DiscoveryPoint& point) {
                 return Json{{"stage", StageName(point.stage)},
                             {"iteration", point.iteration},
                             {"tests", point.num_tested},
                             {"edges", point.num_edges},
                             {"seconds", point.seconds}};
               }));
  AddWeakPlaces(details, members);
  members->Add("images_without_edge",
               ArrayOf(details.images_without_edge, [&](const ReportDetails::ImageAlone& alone) {
                 return Json{{"image", alone.image},
                             {"features", details.images[alone.image].num_features},
                             {"failed", alone.num_failed},
                             {"candidates", ArrayOf(alone.candidates, CandidateEntry)}};
               }));
}

}  // namespace

std::string MakeJsonReport(const ReportData& data) {
  Members members;
  members.Add("schema", kSchema);
  members.Add("version", 1);
  members.Add("program", std::string("graphmatch_matcher ") + kVersion);
  members.Add("replay", data.modelled_seconds.has_value());
  members.Add("finished", data.finished);
  members.Add("stopped_by", OrNull(data.stopped_by));
  if (!data.finished) {
    members.Add("expected_tests_left", OrNull(data.num_expected_tests_left));
  }
  members.Add("strategy", data.strategy);
  if (data.descriptor) members.Add("descriptor", *data.descriptor);
  members.Add("min_num_inliers", data.min_num_inliers);
  members.Add("threads", data.num_threads);
  members.Add("peak_memory_mb", OrNull(data.peak_memory_mb));
  members.Add("images", {{"total", data.num_images},
                         {"without_features", data.num_images_without_features},
                         {"isolated", data.num_images_without_edge}});
  members.Add("graph", {{"tested", data.num_tested},
                        {"edges", data.num_edges},
                        {"components", data.num_components},
                        {"largest_component", data.largest_component}});
  Json seconds = {{"mixture", data.preprocessing_seconds.mixture},
                  {"vectors", data.preprocessing_seconds.vectors},
                  {"ranking", data.preprocessing_seconds.ranking},
                  {"matching", data.matching_seconds},
                  {"total", data.total_seconds}};
  if (data.modelled_seconds) seconds["modelled"] = *data.modelled_seconds;
  members.Add("seconds", seconds);
  Json stages;
  for (const LoopStage stage : kLoopStages) stages[StageName(stage)] = Stage(data.stages[stage]);
  members.Add("stages", stages);
  members.Add("iterations", ArrayOf(data.iterations, [](const IterationStatistics& iteration) {
                Json entry = {{"iteration", iteration.iteration}};
                for (const LoopStage stage : {LoopStage::kSampling, LoopStage::kPropagation}) {
                  entry[StageName(stage)] = Stage(iteration.stages[stage]);
                }
                return entry;
              }));
  if (data.details) AddDetails(*data.details, &members);
  return members.Object();
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
