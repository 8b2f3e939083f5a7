#include "colmap_graphmatch/pipeline/image_ranking.h"

#include <algorithm>
#include <boost/crc.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/encoding/numpy_file.h"
#include "colmap_graphmatch/pipeline/given_vectors.h"
#include "colmap_graphmatch/pipeline/ranked_lists.h"
#include "colmap_graphmatch/pipeline/text_file.h"
#include "colmap_graphmatch/pipeline/timed.h"

namespace colmap_graphmatch {
namespace {

void Describe(const VectorModelTraining& training, const ImageVectorOptions& options,
              PipelineObserver& observer) {
  const auto num_components = training.model.mixture.NumComponents();
  if (num_components < options.gmm.num_components) {
    observer.OnWarning("The images have too few different features for " +
                       std::to_string(options.gmm.num_components) +
                       " Gaussian components; the mixture has " + std::to_string(num_components) +
                       ".");
  }
  observer.OnInfo("Learnt a mixture of " + std::to_string(num_components) + " Gaussians in " +
                  std::to_string(training.num_iterations) + " iterations of EM" +
                  (training.converged ? "" : " (not yet converged)") + ".");
}

}  // namespace

const char* NameOfVectors(ImageVectorOptions::Descriptor descriptor) {
  switch (descriptor) {
    case ImageVectorOptions::Descriptor::kFisher:
      return "Fisher vectors";
    case ImageVectorOptions::Descriptor::kVlad:
      return "VLAD";
    case ImageVectorOptions::Descriptor::kGist:
      return "GIST";
    case ImageVectorOptions::Descriptor::kFile:
      break;
  }
  return "vectors";
}

namespace {

// Images encoded at a time, and kept for the next run.
constexpr std::size_t kImagesPerBlock = 2048;

// The model that earlier runs used, or a new one.
VectorModel FindModel(const ImageVectorOptions& options, Database& database,
                      const std::vector<ImageRecord>& images, RunState& state, ThreadPool& threads,
                      const StopRequest& stop, PipelineObserver& observer) {
  const bool has_mixture = HasMixture(options.descriptor);
  std::optional<VectorModel> kept = state.ReadModel();
  if (kept) {
    if (has_mixture) {
      observer.OnInfo("The mixture of " + std::to_string(kept->mixture.NumComponents()) +
                      " Gaussians is that of the last run.");
    }
    return std::move(*kept);
  }
  VectorModelTraining training = LearnVectorModel(options, database, images, threads, stop);
  if (has_mixture) Describe(training, options, observer);
  state.KeepModel(training.model);
  return std::move(training.model);
}

// The vectors of all images: those of earlier runs, as long as the features are the same, and new
// ones.
std::vector<float> FindVectors(const ImageVectorOptions& options, const VectorModel& model,
                               Database& database, const std::vector<ImageRecord>& images,
                               RunState& state, ThreadPool& threads, const StopRequest& stop,
                               PipelineObserver& observer) {
  const std::size_t dim = VectorDim(options, model);
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
        EncodeImages(options, model, database, records, threads, stop);
    for (std::size_t i = 0; i < block.size(); ++i) {
      std::copy_n(encoded.begin() + static_cast<std::ptrdiff_t>(i * dim), dim,
                  vectors.begin() + static_cast<std::ptrdiff_t>(block[i] * dim));
    }
    state.KeepVectors(block, dim, encoded.data());
  }
  const std::size_t num_kept = images.size() - missing.size();
  observer.OnInfo("Described " + std::to_string(images.size()) + " images by " +
                  NameOfVectors(options.descriptor) + " of " + std::to_string(dim) + " entries" +
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

// Changes when a photo does, as far as its size and time tell. A photo that is missing is no error
// here.
std::string ChecksumOfPhotos(const std::filesystem::path& directory,
                             const std::vector<ImageRecord>& images) {
  boost::crc_32_type crc;
  for (const ImageRecord& image : images) {
    std::error_code ignored;
    const std::filesystem::path photo = directory / image.name;
    const std::uintmax_t size = std::filesystem::file_size(photo, ignored);
    const auto time = std::filesystem::last_write_time(photo, ignored).time_since_epoch().count();
    crc.process_bytes(&size, sizeof(size));
    crc.process_bytes(&time, sizeof(time));
  }
  return std::to_string(crc.checksum());
}

RankedImages Rank(const ImageRankingOptions& options, std::vector<ImageRecord> images,
                  std::size_t dim, std::vector<float> vectors, ThreadPool& threads,
                  const StopRequest& stop, ImageRankingSeconds* seconds) {
  RankedImages ranked;
  ranked.images = std::move(images);
  ranked.ranking = Timed(&seconds->ranking, [&] {
    return std::make_unique<VectorRanking>(options.ranking, ranked.images.size(), dim,
                                           std::move(vectors), threads, &stop);
  });
  return ranked;
}

RankedImages RankGivenVectors(const ImageRankingOptions& options,
                              const std::vector<ImageRecord>& images,
                              const std::vector<ImageFingerprint>& fingerprints, RunState& state,
                              ThreadPool& threads, const StopRequest& stop,
                              PipelineObserver& observer, ImageRankingSeconds* seconds) {
  GivenVectors given = Timed(
      &seconds->vectors, [&] { return ReadGivenVectors(options.vectors.vectors_path, images); });
  WarnOfSkippedLines(given, options.vectors.vectors_path, "an image", observer);
  if (given.images.size() < images.size()) {
    observer.OnWarning(std::to_string(images.size() - given.images.size()) + " of " +
                       std::to_string(images.size()) + " images have no vector in " +
                       options.vectors.vectors_path.string() +
                       " and are not ranked, so not matched.");
  }
  observer.OnInfo("Read " + std::to_string(given.images.size()) + " vectors of " +
                  std::to_string(given.dim) + " entries.");
  state.SelectGiven("vectors " + given.checksum, fingerprints);
  return Rank(options, std::move(given.images), given.dim, std::move(given.rows), threads, stop,
              seconds);
}

}  // namespace

void ImageRankingOptions::Check() const {
  vectors.Check();
  const bool given = vectors.descriptor == ImageVectorOptions::Descriptor::kFile;
  if (!export_path.empty() && export_path.extension() != ".npy") {
    throw OptionsError("--GraphMatching.export_vectors is " + export_path.string() +
                       "; its name must end in .npy (the names go beside it, into .txt).");
  }
  if (!ranking_path.empty() && vectors.descriptor != ImageVectorOptions::Descriptor::kFisher) {
    throw OptionsError(
        "--GraphMatching.ranking_path and --GraphMatching.descriptor contradict each other: give "
        "one of them.");
  }
  if (!export_path.empty() && (given || !ranking_path.empty())) {
    throw OptionsError(
        "--GraphMatching.export_vectors writes vectors that this program makes: there are none "
        "with --GraphMatching.ranking_path or --GraphMatching.vectors_path.");
  }
}

RankedImages RankImages(const ImageRankingOptions& options, Database& database,
                        const std::vector<ImageRecord>& images,
                        const std::vector<ImageFingerprint>& fingerprints,
                        const std::vector<VerifiedPair>& known, RunState& state,
                        ThreadPool& threads, const StopRequest& stop, PipelineObserver& observer,
                        ImageRankingSeconds* seconds) {
  if (!options.ranking_path.empty()) {
    RankedLists lists = Timed(&seconds->ranking,
                              [&] { return ReadRankedLists(options.ranking_path, images, &stop); });
    WarnOfSkippedLines(lists, options.ranking_path, "two images", observer);
    state.SelectGiven("ranked lists " + lists.checksum, fingerprints);
    return {images, std::move(lists.ranking)};
  }
  if (options.vectors.descriptor == ImageVectorOptions::Descriptor::kFile) {
    return RankGivenVectors(options, images, fingerprints, state, threads, stop, observer, seconds);
  }
  const bool reads_photos = options.vectors.descriptor == ImageVectorOptions::Descriptor::kGist;
  state.Select(options.vectors, fingerprints,
               reads_photos ? ChecksumOfPhotos(options.vectors.image_path, images) : "");
  WarnOfChangedFeatures(state.FindChanged(), images, known, database.Path().string(), observer);
  const VectorModel model = Timed(&seconds->mixture, [&] {
    return FindModel(options.vectors, database, images, state, threads, stop, observer);
  });
  std::vector<float> vectors = Timed(&seconds->vectors, [&] {
    return FindVectors(options.vectors, model, database, images, state, threads, stop, observer);
  });
  const std::size_t dim = vectors.size() / images.size();
  if (!options.export_path.empty()) {
    NamedVectors named;
    for (const ImageRecord& image : images) named.names.push_back(image.name);
    named.dim = dim;
    named.rows = vectors;
    WriteNamedVectors(options.export_path, named);
    observer.OnInfo("Wrote the vectors to " + options.export_path.string() + ".");
  }
  return Rank(options, images, dim, std::move(vectors), threads, stop, seconds);
}

}  // namespace colmap_graphmatch
