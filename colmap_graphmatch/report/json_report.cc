#include "colmap_graphmatch/report/json_report.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/version.h"

namespace colmap_graphmatch {
namespace {

using Json = nlohmann::ordered_json;

Json Stage(const StageStatistics& stage) {
  return {{"tested", stage.num_tested},           {"edges", stage.num_edges},
          {"failed", stage.num_failed},           {"known", stage.num_known},
          {"known_edges", stage.num_known_edges}, {"seconds", stage.seconds}};
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

}  // namespace

std::string MakeJsonReport(const PipelineOptions& options, const PipelineResult& result) {
  const GraphMatchResult& matching = result.matching;
  Json report;
  report["schema"] = "graphmatch-report";
  report["version"] = 1;
  report["program"] = std::string("graphmatch_matcher ") + kVersion;
  report["replay"] = result.replayed;
  report["finished"] = matching.finished;
  report["strategy"] = Name(options);
  if (!result.listed) {
    report["descriptor"] = options.ranking.ranking_path.empty() ? "fisher" : "lists";
  }
  report["threads"] = result.num_threads;
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
  report["stages"] = {{"sampling", Stage(matching.sampling)},
                      {"propagation", Stage(matching.propagation)},
                      {"listed", Stage(matching.listed)},
                      {"retrieval", Stage(matching.retrieval)},
                      {"expansion", Stage(matching.expansion)}};
  report["iterations"] = Json::array();
  for (const IterationStatistics& iteration : matching.iterations) {
    report["iterations"].push_back(
        {{"sampling", Stage(iteration.sampling)}, {"propagation", Stage(iteration.propagation)}});
  }
  return report.dump(2) + "\n";
}

void WriteJsonReport(const std::filesystem::path& path, const PipelineOptions& options,
                     const PipelineResult& result) {
  const std::filesystem::path partial = path.string() + ".partial";
  const auto fail = [&](const std::string& reason) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw FileError("Cannot write the report " + path.string() + ": " + reason + ".");
  };
  std::ofstream file(partial, std::ios::trunc);
  file << MakeJsonReport(options, result);
  file.close();
  if (!file) fail(std::strerror(errno));
  std::error_code error;
  std::filesystem::rename(partial, path, error);
  if (error) fail(error.message());
}

}  // namespace colmap_graphmatch
