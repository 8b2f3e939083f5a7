#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"

#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/database.h"
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

}  // namespace

void PipelineOptions::Check() const {
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

  // COLMAP is looked at first: that it is missing should not be learnt after the features were
  // read.
  const WorkDirectory work(options.work_path);
  const ColmapInstallation colmap = DetectColmap(options.colmap_path, work.Path(), stop);
  ColmapVerifierOptions verifier_options = options.verification;
  verifier_options.num_threads = options.num_threads;
  ColmapVerifier verifier(verifier_options, colmap, database, images, work.Path(), stop,
                          [&](const std::string& warning) { observer.OnWarning(warning); });
  observer.OnInfo("COLMAP " + colmap.Version() + " at " + colmap.executable.string() + ", " +
                  (verifier.UsesGpu() ? "GPU" : "CPU") +
                  ", processes: " + std::to_string(verifier.NumProcesses()) +
                  ", threads in each: " + std::to_string(verifier.NumThreadsPerProcess()) + ".");

  ImageVectorOptions vector_options = options.vectors;
  vector_options.seed = options.seed;
  vector_options.gmm.seed = options.seed;
  const GmmTraining training = Timed(&result.mixture_seconds, [&] {
    return LearnMixture(vector_options, database, images, threads, stop);
  });
  Describe(training, options, observer);

  std::vector<float> vectors = Timed(&result.vectors_seconds, [&] {
    return EncodeImages(vector_options, training.mixture, database, images, threads, stop);
  });
  const std::size_t dim = vectors.size() / images.size();
  const Ranking ranking = Timed(&result.ranking_seconds, [&] {
    return Ranking(options.ranking, images.size(), dim, std::move(vectors), threads, &stop);
  });
  observer.OnInfo("Described and ranked " + std::to_string(images.size()) +
                  " images by Fisher vectors of " + std::to_string(dim) + " entries.");

  result.matching = Timed(&result.matching_seconds, [&] {
    return RunGraphMatch(options.graph, ranking, Ids(images), verifier, threads,
                         [&](const LoopProgress& progress) { observer.OnProgress(progress); });
  });
  result.total_seconds = total.Seconds();
  return result;
}

}  // namespace colmap_graphmatch
