#include "colmap_graphmatch/report/json_report.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "colmap_graphmatch/base/version.h"
#include "colmap_graphmatch/base/whole_file.h"

namespace colmap_graphmatch {
namespace {

using Json = nlohmann::ordered_json;

Json Stage(const StageStatistics& stage) {
  return {{"tested", stage.num_tested},           {"edges", stage.num_edges},
          {"failed", stage.num_failed},           {"known", stage.num_known},
          {"known_edges", stage.num_known_edges}, {"seconds", stage.seconds}};
}

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
    report["descriptor"] = DescriptorName(options.ranking);
  }
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
  report["stages"] = {{"sampling", Stage(matching.sampling)},
                      {"propagation", Stage(matching.propagation)},
                      {"listed", Stage(matching.listed)},
                      {"retrieval", Stage(matching.retrieval)},
                      {"expansion", Stage(matching.expansion)}};
  report["iterations"] = Json::array();
  for (const IterationStatistics& iteration : matching.iterations) {
    report["iterations"].push_back({{"iteration", iteration.iteration},
                                    {"sampling", Stage(iteration.sampling)},
                                    {"propagation", Stage(iteration.propagation)}});
  }
  return report.dump(2) + "\n";
}

void WriteJsonReport(const std::filesystem::path& path, const PipelineOptions& options,
                     const PipelineResult& result) {
  WriteWholeFile(path, [&](std::ostream& file) { file << MakeJsonReport(options, result); });
}

}  // namespace colmap_graphmatch
