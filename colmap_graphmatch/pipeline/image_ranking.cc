#include "colmap_graphmatch/pipeline/image_ranking.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/pipeline/ranked_lists.h"
#include "colmap_graphmatch/pipeline/text_file.h"
#include "colmap_graphmatch/pipeline/timed.h"

namespace colmap_graphmatch {
namespace {

void Describe(const GmmTraining& training, const ImageVectorOptions& options,
              PipelineObserver& observer) {
  const auto num_components = training.mixture.NumComponents();
  if (num_components < options.gmm.num_components) {
    observer.OnWarning("The images have too few different features for " +
                       std::to_string(options.gmm.num_components) +
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
GaussianMixture FindMixture(const ImageVectorOptions& options, Database& database,
                            const std::vector<ImageRecord>& images, RunState& state,
                            ThreadPool& threads, const StopRequest& stop,
                            PipelineObserver& observer) {
  const std::optional<GaussianMixture> kept = state.ReadMixture();
  if (kept) {
    observer.OnInfo("The mixture of " + std::to_string(kept->NumComponents()) +
                    " Gaussians is that of the last run.");
    return *kept;
  }
  GmmTraining training = LearnMixture(options, database, images, threads, stop);
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

}  // namespace

void ImageRankingOptions::Check() const { vectors.Check(); }

RankedImages RankImages(const ImageRankingOptions& options, Database& database,
                        const std::vector<ImageRecord>& images,
                        const std::vector<VerifiedPair>& known, RunState& state,
                        ThreadPool& threads, const StopRequest& stop, PipelineObserver& observer,
                        ImageRankingSeconds* seconds) {
  const std::vector<ImageFingerprint> fingerprints = database.ReadFingerprints(images);
  if (!options.ranking_path.empty()) {
    RankedLists lists =
        Timed(&seconds->ranking, [&] { return ReadRankedLists(options.ranking_path, images); });
    WarnOfSkippedLines(lists, options.ranking_path, "two images", observer);
    state.SelectGiven("ranked lists " + lists.checksum, fingerprints);
    return {images, std::move(lists.ranking)};
  }
  state.Select(options.vectors, fingerprints);
  WarnOfChangedFeatures(state.FindChanged(), images, known, database.Path().string(), observer);
  const GaussianMixture mixture = Timed(&seconds->mixture, [&] {
    return FindMixture(options.vectors, database, images, state, threads, stop, observer);
  });
  std::vector<float> vectors = Timed(&seconds->vectors, [&] {
    return FindVectors(options.vectors, mixture, database, images, state, threads, stop, observer);
  });
  const std::size_t dim = vectors.size() / images.size();
  return {images, Timed(&seconds->ranking, [&] {
            return std::make_unique<VectorRanking>(options.ranking, images.size(), dim,
                                                   std::move(vectors), threads, &stop);
          })};
}

}  // namespace colmap_graphmatch
