#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"

#include <algorithm>
#include <boost/crc.hpp>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/graph/listed_pairs.h"
#include "colmap_graphmatch/matching/top_two.h"
#include "colmap_graphmatch/pipeline/pair_list.h"
#include "colmap_graphmatch/pipeline/run_state.h"
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

// Images encoded at a time, and kept for the next run.
constexpr std::size_t kImagesPerBlock = 2048;

// The mixture that earlier runs used, or a new one.
GaussianMixture FindMixture(const PipelineOptions& options, const ImageVectorOptions& vectors,
                            Database& database, const std::vector<ImageRecord>& images,
                            RunState& state, ThreadPool& threads, const StopRequest& stop,
                            PipelineObserver& observer) {
  const std::optional<GaussianMixture> kept = state.ReadMixture();
  if (kept) {
    observer.OnInfo("The mixture of " + std::to_string(kept->NumComponents()) +
                    " Gaussians is that of the last run.");
    return *kept;
  }
  GmmTraining training = LearnMixture(vectors, database, images, threads, stop);
  Describe(training, options, observer);
  state.KeepMixture(training.mixture);
  return std::move(training.mixture);
}

// The Fisher vectors of all images: those of earlier runs, as long as the features are the same,
// and new ones.
std::vector<float> FindVectors(const ImageVectorOptions& options, const GaussianMixture& mixture,
                               Database& database, const std::vector<ImageRecord>& images,
                               RunState& state, ThreadPool& threads, const StopRequest& stop,
                               PipelineObserver& observer) {
  const auto dim = static_cast<std::size_t>(2 * mixture.NumComponents() * mixture.Dim());
  std::vector<float> vectors(images.size() * dim);
  const std::vector<bool> kept = state.ReadVectors(dim, vectors.data());
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (!kept[i]) missing.push_back(i);
  }
  for (std::size_t first = 0; first < missing.size(); first += kImagesPerBlock) {
    const std::vector<std::size_t> block(
        missing.begin() + static_cast<std::ptrdiff_t>(first),
        missing.begin() +
            static_cast<std::ptrdiff_t>(std::min(first + kImagesPerBlock, missing.size())));
    std::vector<ImageRecord> records;
    records.reserve(block.size());
    for (const std::size_t i : block) records.push_back(images[i]);
    const std::vector<float> encoded =
        EncodeImages(options, mixture, database, records, threads, stop);
    for (std::size_t i = 0; i < block.size(); ++i) {
      std::copy_n(encoded.begin() + static_cast<std::ptrdiff_t>(i * dim), dim,
                  vectors.begin() + static_cast<std::ptrdiff_t>(block[i] * dim));
    }
    state.KeepVectors(block, dim, encoded.data());
  }
  const std::size_t num_kept = images.size() - missing.size();
  observer.OnInfo("Described " + std::to_string(images.size()) + " images by Fisher vectors of " +
                  std::to_string(dim) + " entries" +
                  (num_kept == 0 ? "."
                                 : "; those of " + std::to_string(num_kept) +
                                       " images are from the last run."));
  return vectors;
}

// Their pairs were tested with features that are gone; COLMAP itself keeps such pairs without a
// word.
void WarnOfChangedFeatures(const std::vector<ImageId>& changed,
                           const std::vector<ImageRecord>& images,
                           const std::vector<VerifiedPair>& known, const std::string& database_path,
                           PipelineObserver& observer) {
  const auto has_changed = [&](ImageId image) {
    return std::binary_search(changed.begin(), changed.end(), image);
  };
  std::size_t num_pairs = 0;
  for (const VerifiedPair& pair : known) {
    num_pairs += has_changed(pair.pair.id1) || has_changed(pair.pair.id2) ? 1 : 0;
  }
  if (num_pairs == 0) return;
  const auto first = std::find_if(images.begin(), images.end(),
                                  [&](const ImageRecord& image) { return has_changed(image.id); });
  observer.OnWarning("Images have other features than in the last run (" +
                     std::to_string(changed.size()) + ", the first is \"" + first->name +
                     "\"), and " + std::to_string(num_pairs) +
                     " pairs of theirs still have the matches of the old features. To match all "
                     "anew: colmap database_cleaner --type matches --database_path " +
                     database_path);
}

// From the features to ranked lists: mixture, Fisher vectors, distances.
Ranking RankImages(const PipelineOptions& options, Database& database,
                   const std::vector<ImageRecord>& images, const std::vector<VerifiedPair>& known,
                   RunState& state, ThreadPool& threads, const StopRequest& stop,
                   PipelineObserver& observer, PipelineResult* result) {
  ImageVectorOptions vector_options = options.vectors;
  vector_options.seed = options.seed;
  vector_options.gmm.seed = options.seed;
  state.Select(vector_options, database.ReadFingerprints(images));
  WarnOfChangedFeatures(state.FindChanged(), images, known, options.database_path.string(),
                        observer);
  const GaussianMixture mixture = Timed(&result->mixture_seconds, [&] {
    return FindMixture(options, vector_options, database, images, state, threads, stop, observer);
  });
  std::vector<float> vectors = Timed(&result->vectors_seconds, [&] {
    return FindVectors(vector_options, mixture, database, images, state, threads, stop, observer);
  });
  const std::size_t dim = vectors.size() / images.size();
  return Timed(&result->ranking_seconds, [&] {
    return Ranking(options.ranking, images.size(), dim, std::move(vectors), threads, &stop);
  });
}

// What the seeds of a loop depend on, apart from the images and their vectors.
std::string LoopKey(const PipelineOptions& options, const GraphMatchOptions& graph) {
  boost::crc_32_type restrictions;
  for (const bool seeks : graph.restrictions.seeking) restrictions.process_byte(seeks ? 1 : 0);
  for (const std::uint32_t frame : graph.restrictions.frames) {
    restrictions.process_bytes(&frame, sizeof(frame));
  }
  std::string key = "loop";
  for (const int value :
       {graph.number_sample_iterations, graph.max_num_neighbors, graph.num_to_propagate,
        graph.max_tests_for_sampling, static_cast<int>(graph.sampling_schedule),
        graph.count_incoming_tests ? 1 : 0, static_cast<int>(graph.propagation_distance),
        graph.propagate_untested_only ? 1 : 0, graph.propagate_from_new_edges_only ? 1 : 0,
        graph.stop_sampling_without_edges ? 1 : 0, options.verification.min_num_inliers}) {
    key += " " + std::to_string(value);
  }
  return key + ", restrictions " + std::to_string(restrictions.checksum());
}

bool RetrievesOnce(PipelineOptions::Strategy strategy) {
  return strategy == PipelineOptions::Strategy::kRetrieval ||
         strategy == PipelineOptions::Strategy::kBriad;
}

RetrievalOptions MakeRetrievalOptions(const PipelineOptions& options) {
  const bool expands = options.strategy == PipelineOptions::Strategy::kBriad;
  RetrievalOptions retrieval;
  retrieval.num_images = options.num_retrieved_images > 0 ? options.num_retrieved_images
                         : expands                        ? 40
                                                          : 120;
  retrieval.num_expansions = expands ? options.num_expansions : 0;
  return retrieval;
}

GraphMatchOptions MakeGraphOptions(const PipelineOptions& options) {
  GraphMatchOptions graph = options.graph;
  if (options.strategy == PipelineOptions::Strategy::kSampling) graph.num_to_propagate = 0;
  if (options.strategy == PipelineOptions::Strategy::kPropagation) {
    graph.number_sample_iterations = std::min(graph.number_sample_iterations, 1);
  }
  return graph;
}

template <typename List>
void WarnOfSkippedLines(const List& list, const std::filesystem::path& path,
                        const std::string& what, PipelineObserver& observer) {
  if (list.num_skipped == 0) return;
  observer.OnWarning(std::to_string(list.num_skipped) + " line(s) of " + path.string() +
                     " that do not name " + what +
                     " of the database with features are skipped; the first is \"" +
                     list.first_skipped + "\".");
}

PairRestrictions FindRestrictions(const PipelineOptions& options, Database& database,
                                  const std::vector<ImageRecord>& images,
                                  PipelineObserver& observer) {
  PairRestrictions restrictions;
  if (!options.image_list_path.empty()) {
    const ImageList list = ReadImageList(options.image_list_path, images);
    WarnOfSkippedLines(list, options.image_list_path, "an image", observer);
    for (const ImageRecord& image : images) {
      restrictions.seeking.push_back(
          std::binary_search(list.images.begin(), list.images.end(), image.id));
    }
  }
  if (options.skip_image_pairs_in_same_frame) {
    const std::map<ImageId, std::uint32_t> frames = database.ReadFrames();
    for (const ImageRecord& image : images) {
      const auto frame = frames.find(image.id);
      restrictions.frames.push_back(frame == frames.end() ? 0 : frame->second);
    }
  }
  return restrictions;
}

std::vector<ImagePair> ReadListedPairs(const std::filesystem::path& path,
                                       const std::vector<ImageRecord>& images,
                                       PipelineObserver& observer) {
  PairList list = ReadPairList(path, images);
  WarnOfSkippedLines(list, path, "two different images", observer);
  return std::move(list.pairs);
}

}  // namespace

void PipelineOptions::Check() const {
  if (!match_list_path.empty() && strategy != Strategy::kGraphMatch) {
    throw OptionsError(
        "--GraphMatching.match_list_path and --GraphMatching.strategy contradict each other: give "
        "one of them.");
  }
  if (!match_list_path.empty() && !image_list_path.empty()) {
    throw OptionsError(
        "--GraphMatching.match_list_path lists pairs, --VocabTreeMatching.match_list_path images "
        "that look for partners: give one of them.");
  }
  EffectiveNumThreads(num_threads);
  if (num_retrieved_images < 0) {
    throw OptionsError("num_retrieved_images is " + std::to_string(num_retrieved_images) +
                       "; it must be positive, or 0 to have it chosen.");
  }
  MakeRetrievalOptions(*this).Check();
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
  const auto info = [&](const std::string& message) { observer.OnInfo(message); };
  const auto warn = [&](const std::string& warning) { observer.OnWarning(warning); };
  RunState state(options.database_path, options.verification.lock_timeout, stop, info, warn);
  const std::vector<ImageRecord> images = WithFeatures(all_images);
  result.num_images = all_images.size();
  result.num_images_without_features = all_images.size() - images.size();
  if (images.size() < all_images.size()) {
    observer.OnWarning(std::to_string(result.num_images_without_features) + " of " +
                       std::to_string(all_images.size()) +
                       " images have no features and cannot be matched.");
  }
  if (images.size() == 1) {
    observer.OnWarning("Only one image has features: there is no pair to test.");
  }

  const bool from_list = !options.match_list_path.empty();
  std::vector<ImagePair> listed_pairs;
  if (from_list) listed_pairs = ReadListedPairs(options.match_list_path, all_images, observer);
  const PairRestrictions restrictions = FindRestrictions(options, database, images, observer);

  // COLMAP is looked at first: that it is missing should not be learnt after the features were
  // read.
  const WorkDirectory work(options.work_path, WorkDirectory::Guard::kGuarded);
  const ColmapInstallation colmap = DetectColmap(options.colmap_path, work.Path(), stop);
  ColmapVerifierOptions verifier_options = options.verification;
  verifier_options.num_threads = options.num_threads;
  ColmapVerifier verifier(verifier_options, colmap, database, images, work.Path(), stop, warn);
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
      return VerifyListedPairs(listed_pairs, Ids(images), verifier, on_progress, restrictions);
    });
  } else if (options.strategy == PipelineOptions::Strategy::kExhaustive) {
    result.matching = Timed(&result.matching_seconds, [&] {
      return VerifyAllPairs(Ids(images), verifier, on_progress, restrictions);
    });
  } else {
    const Ranking ranking = RankImages(options, database, images, verifier.KnownPairs(), state,
                                       threads, stop, observer, &result);
    const std::vector<ImageId> ids = Ids(images);
    result.matching = Timed(&result.matching_seconds, [&] {
      if (RetrievesOnce(options.strategy)) {
        RetrievalOptions retrieval = MakeRetrievalOptions(options);
        retrieval.restrictions = restrictions;
        return RunRetrieval(retrieval, ranking, ids, verifier, threads, on_progress);
      }
      GraphMatchOptions graph = MakeGraphOptions(options);
      graph.restrictions = restrictions;
      const std::string key = LoopKey(options, graph);
      const std::vector<ImagePair> seeds =
          ChooseSeeds(graph, ranking, ids, verifier, threads, state.ReadSeeds(key));
      state.KeepSeeds(key, seeds);
      return RunGraphMatch(graph, ranking, ids, verifier, threads, on_progress, seeds);
    });
  }
  result.verification = verifier.Statistics();
  result.total_seconds = total.Seconds();
  return result;
}

}  // namespace colmap_graphmatch
