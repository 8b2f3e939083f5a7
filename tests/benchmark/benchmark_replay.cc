// benchmark_replay DATABASE EDGES.tsv: the loop with each of the choices that the paper leaves
// open, verified by a finished matching graph instead of COLMAP, on the Fisher vectors of a
// database with features.
//
// EDGES.tsv: lines "image1<TAB>image2<TAB>inliers..."; lines that start with '#' or with no number
// of inliers are skipped.

#include <fmt/format.h>

#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/graph/graphmatch.h"
#include "colmap_graphmatch/graph/retrieval.h"
#include "colmap_graphmatch/pipeline/image_vectors.h"
#include "colmap_graphmatch/ranking/ranking.h"
#include "colmap_graphmatch/verification/replay_verifier.h"

namespace colmap_graphmatch {
namespace {

std::unordered_map<ImagePair, std::uint32_t> ReadEdges(const std::string& path,
                                                       const std::vector<ImageRecord>& images) {
  std::map<std::string, ImageId> ids;
  for (const ImageRecord& image : images) ids[image.name] = image.id;
  std::unordered_map<ImagePair, std::uint32_t> edges;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line);
    std::string name1, name2;
    std::uint32_t num_inliers = 0;
    int config = 0;
    if (line.rfind('#', 0) == 0 || !std::getline(fields, name1, '\t') ||
        !std::getline(fields, name2, '\t') || !(fields >> num_inliers >> config)) {
      continue;
    }
    if (ids.count(name1) == 0 || ids.count(name2) == 0 || !IsEdge(num_inliers, config, 15))
      continue;
    edges[ImagePair(ids[name1], ids[name2])] = num_inliers;
  }
  return edges;
}

// The first stage is sampling or retrieval, the second propagation or expansion.
void Print(const std::string& name, const GraphMatchResult& result, std::size_t num_edges) {
  const StageStatistics all = result.All();
  const StageStatistics first = result.sampling + result.retrieval;
  const StageStatistics second = result.propagation + result.expansion;
  fmt::print("{:<42} {:>6} {:>7.4f} {:>7.3f} | {:>6} {:>6.3f} | {:>6} {:>6.3f} | {:>3} {:>4}\n",
             name, all.num_tested,
             static_cast<double>(all.num_edges) / static_cast<double>(num_edges), all.Efficiency(),
             first.num_tested, first.Efficiency(), second.num_tested, second.Efficiency(),
             result.num_components, result.iterations.size());
}

void Run(const std::string& name, const GraphMatchOptions& options, const Ranking& ranking,
         const std::vector<ImageId>& ids, const std::unordered_map<ImagePair, std::uint32_t>& edges,
         ThreadPool& threads) {
  ReplayVerifier verifier(edges);
  Print(name, RunGraphMatch(options, ranking, ids, verifier, threads, nullptr), edges.size());
}

void Main(const std::string& database_path, const std::string& edges_path) {
  ThreadPool threads(-1);
  Database database(database_path, sqlite::Access::kRead, 10);
  const std::vector<ImageRecord> images = WithFeatures(database.ReadImages());
  std::vector<ImageId> ids;
  for (const ImageRecord& image : images) ids.push_back(image.id);
  const auto edges = ReadEdges(edges_path, images);
  fmt::print("{} images, {} edges of {} pairs\n\n", images.size(), edges.size(),
             images.size() * (images.size() - 1) / 2);
  fmt::print("{:<42} {:>6} {:>7} {:>7} | {:>13} | {:>13} | {:>3} {:>4}\n", "options", "tests",
             "recall", "effic.", "sampling", "propagation", "cc", "its");

  const auto rank = [&](const ImageVectorOptions& options) {
    const GmmTraining training = LearnMixture(options, database, images, threads, StopRequest());
    std::vector<float> vectors =
        EncodeImages(options, training.mixture, database, images, threads, StopRequest());
    const std::size_t dim = vectors.size() / images.size();
    return VectorRanking(RankingOptions(), images.size(), dim, std::move(vectors), threads);
  };

  ImageVectorOptions vector_options;
  const VectorRanking ranking = rank(vector_options);
  const auto with = [&](const std::string& name,
                        const std::function<void(GraphMatchOptions*)>& change) {
    GraphMatchOptions options;
    change(&options);
    Run(name, options, ranking, ids, edges, threads);
  };
  using G = GraphMatchOptions;
  with("defaults", [](G*) {});
  with("sampling_schedule round", [](G* g) { g->sampling_schedule = G::SamplingSchedule::kRound; });
  with("sampling_schedule carry", [](G* g) { g->sampling_schedule = G::SamplingSchedule::kCarry; });
  with("count_incoming_tests 1", [](G* g) { g->count_incoming_tests = true; });
  with("propagation_distance neighbor",
       [](G* g) { g->propagation_distance = G::PropagationDistance::kNeighbor; });
  with("propagate_untested_only 0", [](G* g) { g->propagate_untested_only = false; });
  with("propagate_from_new_edges_only 1", [](G* g) { g->propagate_from_new_edges_only = true; });
  with("stop_sampling_without_edges 1", [](G* g) { g->stop_sampling_without_edges = true; });
  with("max_tests_for_sampling 20", [](G* g) { g->max_tests_for_sampling = 20; });
  with("max_tests_for_sampling 40", [](G* g) { g->max_tests_for_sampling = 40; });
  with("num_to_propagate 0 (sampling alone)", [](G* g) { g->num_to_propagate = 0; });
  with("num_to_propagate 2", [](G* g) { g->num_to_propagate = 2; });
  with("num_to_propagate 8", [](G* g) { g->num_to_propagate = 8; });

  const auto retrieve = [&](const std::string& name, int num_images, int num_expansions) {
    RetrievalOptions options;
    options.num_images = num_images;
    options.num_expansions = num_expansions;
    ReplayVerifier verifier(edges);
    Print(fmt::format("{}, {} images", name, num_images),
          RunRetrieval(options, ranking, ids, verifier, threads, nullptr), edges.size());
  };
  with("number_sample_iterations 1 (propagation)", [](G* g) { g->number_sample_iterations = 1; });
  for (const int num_images : {5, 10, 14, 20, 28, 40, 80, 120}) {
    retrieve("strategy retrieval", num_images, 0);
  }
  for (const int num_images : {5, 10, 20, 40}) retrieve("strategy briad", num_images, 4);
  for (const int budget : {10, 20, 30, 60, 120}) {
    with(fmt::format("strategy graphmatch, budget {}", budget),
         [budget](G* g) { g->max_tests_for_sampling = budget; });
    with(fmt::format("strategy sampling, budget {}", budget), [budget](G* g) {
      g->max_tests_for_sampling = budget;
      g->num_to_propagate = 0;
    });
  }

  vector_options.feature_selection = ImageVectorOptions::FeatureSelection::kRandom;
  Run("feature_selection random", G(), rank(vector_options), ids, edges, threads);
  vector_options = ImageVectorOptions();
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    vector_options.seed = seed;
    vector_options.gmm.seed = seed;
    Run("random_seed " + std::to_string(seed), G(), rank(vector_options), ids, edges, threads);
  }
  vector_options = ImageVectorOptions();
  for (const int num : {25000, 50000, 200000}) {
    vector_options.num_training_descriptors = num;
    Run("num_training_descriptors " + std::to_string(num), G(), rank(vector_options), ids, edges,
        threads);
  }
  vector_options = ImageVectorOptions();
  for (const int num_components : {8, 32, 64}) {
    vector_options.gmm.num_components = num_components;
    Run("num_components " + std::to_string(num_components), G(), rank(vector_options), ids, edges,
        threads);
  }
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "benchmark_replay DATABASE EDGES.tsv\n");
    return 1;
  }
  colmap_graphmatch::Main(argv[1], argv[2]);
  return 0;
}
