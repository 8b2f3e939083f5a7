#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"

#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/graph/listed_pairs.h"
#include "colmap_graphmatch/matching/top_two.h"
#include "colmap_graphmatch/pipeline/pair_list.h"
#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/work_directory.h"

namespace colmap_graphmatch {
namespace {

template <typename Function>
auto Timed(double* seconds, const Function& function) {
  const Stopwatch stopwatch;
  auto result = function();
  *seconds = stopwatch.Seconds();
  return result;
}

std::vector<ImageId> Ids(const std::vector<ImageRecord>& images) {
  std::vector<ImageId> ids;
  ids.reserve(images.size());
  for (const ImageRecord& image : images) ids.push_back(image.id);
  return ids;
}

void Describe(const GmmTraining& training, const PipelineOptions& options,
              PipelineObserver& observer) {
  const auto num_components = training.mixture.NumComponents();
  if (num_components < options.vectors.gmm.num_components) {
    observer.OnWarning("The images have too few different features for " +
                       std::to_string(options.vectors.gmm.num_components) +
                       " Gaussian components; the mixture has " + std::to_string(num_components) +
                       ".");
  }
  observer.OnInfo("Learnt a mixture of " + std::to_string(num_components) + " Gaussians in " +
                  std::to_string(training.log_likelihoods.size()) + " iterations of EM" +
                  (training.converged ? "" : " (not yet converged)") + ".");
}

// From the features to ranked lists: mixture, Fisher vectors, distances.
Ranking RankImages(const PipelineOptions& options, Database& database,
                   const std::vector<ImageRecord>& images, ThreadPool& threads,
                   const StopRequest& stop, PipelineObserver& observer, PipelineResult* result) {
  ImageVectorOptions vector_options = options.vectors;
  vector_options.seed = options.seed;
  vector_options.gmm.seed = options.seed;
  const GmmTraining training = Timed(&result->mixture_seconds, [&] {
    return LearnMixture(vector_options, database, images, threads, stop);
  });
  Describe(training, options, observer);

  std::vector<float> vectors = Timed(&result->vectors_seconds, [&] {
    return EncodeImages(vector_options, training.mixture, database, images, threads, stop);
  });
  const std::size_t dim = vectors.size() / images.size();
  observer.OnInfo("Described " + std::to_string(images.size()) + " images by Fisher vectors of " +
                  std::to_string(dim) + " entries.");
  return Timed(&result->ranking_seconds, [&] {
    return Ranking(options.ranking, images.size(), dim, std::move(vectors), threads, &stop);
  });
}

std::vector<ImagePair> ReadListedPairs(const std::filesystem::path& path,
                                       const std::vector<ImageRecord>& images,
                                       PipelineObserver& observer) {
  PairList list = ReadPairList(path, images);
  if (list.num_skipped > 0) {
    observer.OnWarning(
        std::to_string(list.num_skipped) + " line(s) of " + path.string() +
        " that do not name two images of the database with features are skipped; the "
        "first is \"" +
        list.first_skipped + "\".");
  }
  return std::move(list.pairs);
}

}  // namespace

void PipelineOptions::Check() const {
  if (!match_list_path.empty() && strategy != Strategy::kGraphMatch) {
    throw OptionsError(
        "--GraphMatching.match_list_path and --GraphMatching.strategy exhaustive contradict each "
        "other: give one of them.");
  }
  EffectiveNumThreads(num_threads);
  vectors.Check();
  graph.Check();
  verification.Check();
}

PipelineResult RunPipeline(const PipelineOptions& options, const StopRequest& stop,
                           PipelineObserver& observer) {
  options.Check();
  const Stopwatch total;
  PipelineResult result;
  ThreadPool threads(options.num_threads);

  Database database(options.database_path, sqlite::Access::kReadWrite,
                    options.verification.lock_timeout);
  const std::vector<ImageRecord> all_images = database.ReadImages();
  database.CheckWritable();
  const std::vector<ImageRecord> images = WithFeatures(all_images);
  result.num_images = all_images.size();
  result.num_images_without_features = all_images.size() - images.size();
  if (images.size() < all_images.size()) {
    observer.OnWarning(std::to_string(result.num_images_without_features) + " of " +
                       std::to_string(all_images.size()) +
                       " images have no features and cannot be matched.");
  }

  const bool from_list = !options.match_list_path.empty();
  std::vector<ImagePair> listed_pairs;
  if (from_list) listed_pairs = ReadListedPairs(options.match_list_path, all_images, observer);

  // COLMAP is looked at first: that it is missing should not be learnt after the features were
  // read.
  const WorkDirectory work(options.work_path);
  const ColmapInstallation colmap = DetectColmap(options.colmap_path, work.Path(), stop);
  ColmapVerifierOptions verifier_options = options.verification;
  verifier_options.num_threads = options.num_threads;
  ColmapVerifier verifier(verifier_options, colmap, database, images, work.Path(), stop,
                          [&](const std::string& warning) { observer.OnWarning(warning); });
  observer.OnInfo(std::string("Descriptors are matched ") +
                  (verifier.MatchesHere() ? std::string("exactly, with ") + TopTwoTarget() + "."
                                          : "by COLMAP."));
  observer.OnInfo("COLMAP " + colmap.Version() + " at " + colmap.executable.string() + ", " +
                  (verifier.UsesGpu() ? "GPU" : "CPU") +
                  ", processes: " + std::to_string(verifier.NumProcesses()) +
                  ", threads in each: " + std::to_string(verifier.NumThreadsPerProcess()) + ".");

  result.listed = from_list || options.strategy == PipelineOptions::Strategy::kExhaustive;
  const auto on_progress = [&](const LoopProgress& progress) { observer.OnProgress(progress); };
  if (from_list) {
    result.matching = Timed(&result.matching_seconds, [&] {
      return VerifyListedPairs(listed_pairs, Ids(images), verifier, on_progress);
    });
  } else if (options.strategy == PipelineOptions::Strategy::kExhaustive) {
    result.matching = Timed(&result.matching_seconds,
                            [&] { return VerifyAllPairs(Ids(images), verifier, on_progress); });
  } else {
    const Ranking ranking = RankImages(options, database, images, threads, stop, observer, &result);
    result.matching = Timed(&result.matching_seconds, [&] {
      return RunGraphMatch(options.graph, ranking, Ids(images), verifier, threads, on_progress);
    });
  }
  result.verification = verifier.Statistics();
  result.total_seconds = total.Seconds();
  return result;
}

}  // namespace colmap_graphmatch
