#include "colmap_graphmatch/vectors/image_ranker.h"

#include <algorithm>
#include <boost/crc.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "colmap_graphmatch/base/timed.h"
#include "colmap_graphmatch/encoding/numpy_file.h"
#include "colmap_graphmatch/files/given_vectors.h"
#include "colmap_graphmatch/files/ranked_lists.h"
#include "colmap_graphmatch/files/text_file.h"
#include "colmap_graphmatch/ranking/asmk_ranking.h"
#include "colmap_graphmatch/vectors/image_vectors.h"

namespace colmap_graphmatch {
namespace {

// Images encoded at a time, and kept for the next run.
constexpr std::size_t kImagesPerBlock = 2048;

void Describe(const VectorModelTraining& training, const ImageVectorOptions& options,
              const Messages& messages) {
  if (training.model.vocabulary.words.rows() > 0) {
    messages.info("Learnt a vocabulary of " +
                  std::to_string(training.model.vocabulary.words.rows()) + " visual words.");
  }
  if (!HasMixture(options.descriptor)) return;
  const auto num_components = training.model.mixture.NumComponents();
  if (num_components < options.gmm.num_components) {
    messages.warn("The images have too few different features for " +
                  std::to_string(options.gmm.num_components) +
                  " Gaussian components; the mixture has " + std::to_string(num_components) + ".");
  }
  messages.info("Learnt a mixture of " + std::to_string(num_components) + " Gaussians in " +
                std::to_string(training.num_iterations) + " iterations of EM" +
                (training.converged ? "" : " (not yet converged)") + ".");
}

void DescribeKept(const VectorModel& model, const Messages& messages) {
  if (model.vocabulary.words.rows() > 0) {
    messages.info("The vocabulary of " + std::to_string(model.vocabulary.words.rows()) +
                  " visual words is that of the last run.");
  } else if (model.mixture.NumComponents() > 0) {
    messages.info("The mixture of " + std::to_string(model.mixture.NumComponents()) +
                  " Gaussians is that of the last run.");
  }
}

// Their pairs were tested with features that are gone; COLMAP itself keeps such pairs without a
// word.
void WarnOfChangedFeatures(const std::vector<ImageId>& changed,
                           const std::vector<ImageRecord>& images,
                           const std::vector<VerifiedPair>& known, const std::string& database_path,
                           const Messages& messages) {
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
  messages.warn("Images have other features than in the last run (" +
                std::to_string(changed.size()) + ", the first is \"" + first->name + "\"), and " +
                std::to_string(num_pairs) +
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

}  // namespace

ImageRanker::ImageRanker(const ImageRankingOptions& options, std::uint64_t seed, Database& database,
                         const std::vector<ImageRecord>& images,
                         const std::vector<ImageFingerprint>& fingerprints, Checkpoint& checkpoint,
                         ThreadPool& threads, const StopRequest& stop, const Messages& messages)
    : options_(options),
      seed_(seed),
      database_(database),
      images_(images),
      fingerprints_(fingerprints),
      checkpoint_(checkpoint),
      threads_(threads),
      stop_(stop),
      messages_(messages) {}

bool ImageRanker::AreVectorsGiven() const {
  return options_.vectors.descriptor == ImageVectorOptions::Descriptor::kFile;
}

bool ImageRanker::UsesWords() const {
  return options_.vectors.descriptor == ImageVectorOptions::Descriptor::kAsmk;
}

VectorModel ImageRanker::Learn(const std::vector<VerifiedPair>& known) {
  if (AreListsGiven() || AreVectorsGiven()) return {};
  SelectKept(known);
  return Timed(&seconds_.mixture, [&] { return FindModel(); });
}

ImageVectors ImageRanker::Encode(const VectorModel& model) {
  if (AreListsGiven()) return {};
  if (AreVectorsGiven()) return ReadVectors();
  ImageVectors vectors;
  vectors.images = images_;
  if (UsesWords()) {
    vectors.words = Timed(&seconds_.vectors, [&] { return FindWords(model); });
    return vectors;
  }
  vectors.rows = Timed(&seconds_.vectors, [&] { return FindVectors(model); });
  vectors.dim = vectors.rows.size() / images_.size();
  if (!options_.export_path.empty()) Export(vectors);
  return vectors;
}

RankedImages ImageRanker::Rank(ImageVectors vectors) {
  if (AreListsGiven()) return ReadLists();
  RankedImages ranked;
  ranked.images = std::move(vectors.images);
  ranked.ranking = Timed(&seconds_.ranking, [&]() -> std::unique_ptr<Ranking> {
    if (UsesWords()) {
      return std::make_unique<AsmkRanking>(RankingOptions(), std::move(vectors.words), threads_,
                                           &stop_);
    }
    return std::make_unique<VectorRanking>(RankingOptions(), ranked.images.size(), vectors.dim,
                                           std::move(vectors.rows), threads_, &stop_);
  });
  return ranked;
}

void ImageRanker::SelectKept(const std::vector<VerifiedPair>& known) {
  const bool reads_photos = options_.vectors.descriptor == ImageVectorOptions::Descriptor::kGist;
  checkpoint_.Select(options_.vectors, seed_, fingerprints_,
                     reads_photos ? ChecksumOfPhotos(options_.vectors.image_path, images_) : "");
  WarnOfChangedFeatures(checkpoint_.FindChanged(), images_, known, database_.Path().string(),
                        messages_);
}

// The model that earlier runs used, or a new one.
VectorModel ImageRanker::FindModel() {
  std::optional<VectorModel> kept = checkpoint_.ReadModel();
  if (kept) {
    DescribeKept(*kept, messages_);
    return std::move(*kept);
  }
  VectorModelTraining training =
      LearnVectorModel(options_.vectors, seed_, database_, images_, threads_, stop_);
  Describe(training, options_.vectors, messages_);
  checkpoint_.KeepModel(training.model);
  return std::move(training.model);
}

// The vectors of all images: those of earlier runs, as long as the features are the same, and new
// ones.
std::vector<float> ImageRanker::FindVectors(const VectorModel& model) {
  const std::size_t dim = VectorDim(options_.vectors, model);
  std::vector<float> vectors(images_.size() * dim);
  const std::vector<bool> kept = checkpoint_.ReadVectors(dim, vectors.data());
  ForEachBlockOfMissing(
      kept, [&](const std::vector<ImageRecord>& records, const std::vector<std::size_t>& block) {
        const std::vector<float> encoded =
            EncodeImages(options_.vectors, model, database_, records, threads_, stop_);
        for (std::size_t i = 0; i < block.size(); ++i) {
          std::copy_n(encoded.begin() + static_cast<std::ptrdiff_t>(i * dim), dim,
                      vectors.begin() + static_cast<std::ptrdiff_t>(block[i] * dim));
        }
        checkpoint_.KeepVectors(block, dim, encoded.data());
      });
  DescribeEncoding(std::string(NameOfVectors(options_.vectors.descriptor)) + " of " +
                       std::to_string(dim) + " entries",
                   kept);
  return vectors;
}

// The same for visual words.
std::vector<VisualWords> ImageRanker::FindWords(const VectorModel& model) {
  std::vector<VisualWords> words(images_.size());
  const std::vector<bool> kept =
      checkpoint_.ReadWords(static_cast<std::size_t>(model.vocabulary.words.rows()), &words);
  ForEachBlockOfMissing(
      kept, [&](const std::vector<ImageRecord>& records, const std::vector<std::size_t>& block) {
        std::vector<VisualWords> encoded =
            EncodeImagesAsWords(model, database_, records, threads_, stop_);
        checkpoint_.KeepWords(block, encoded);
        for (std::size_t i = 0; i < block.size(); ++i) words[block[i]] = std::move(encoded[i]);
      });
  DescribeEncoding(NameOfVectors(options_.vectors.descriptor), kept);
  return words;
}

void ImageRanker::ForEachBlockOfMissing(const std::vector<bool>& kept,
                                        const MakeBlock& make) const {
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (!kept[i]) missing.push_back(i);
  }
  for (std::size_t first = 0; first < missing.size(); first += kImagesPerBlock) {
    const std::vector<std::size_t> block(
        missing.begin() + static_cast<std::ptrdiff_t>(first),
        missing.begin() +
            static_cast<std::ptrdiff_t>(std::min(first + kImagesPerBlock, missing.size())));
    std::vector<ImageRecord> records;
    records.reserve(block.size());
    for (const std::size_t i : block) records.push_back(images_[i]);
    make(records, block);
  }
}

void ImageRanker::DescribeEncoding(const std::string& what, const std::vector<bool>& kept) const {
  const auto num_kept = std::count(kept.begin(), kept.end(), true);
  messages_.info("Described " + std::to_string(images_.size()) + " images by " + what +
                 (num_kept == 0 ? "."
                                : "; those of " + std::to_string(num_kept) +
                                      " images are from the last run."));
}

ImageVectors ImageRanker::ReadVectors() {
  const std::filesystem::path& path = options_.vectors.vectors_path;
  GivenVectors given = Timed(&seconds_.vectors, [&] { return ReadGivenVectors(path, images_); });
  WarnOfSkippedLines(given, path, "an image", messages_);
  if (given.images.size() < images_.size()) {
    messages_.warn(std::to_string(images_.size() - given.images.size()) + " of " +
                   std::to_string(images_.size()) + " images have no vector in " + path.string() +
                   " and are not ranked, so not matched.");
  }
  messages_.info("Read " + std::to_string(given.images.size()) + " vectors of " +
                 std::to_string(given.dim) + " entries.");
  checkpoint_.SelectGiven("vectors " + given.checksum, fingerprints_);
  return {std::move(given.images), given.dim, std::move(given.rows), {}};
}

RankedImages ImageRanker::ReadLists() {
  const std::filesystem::path& path = options_.ranking_path;
  RankedLists lists =
      Timed(&seconds_.ranking, [&] { return ReadRankedLists(path, images_, &stop_); });
  WarnOfSkippedLines(lists, path, "two images", messages_);
  checkpoint_.SelectGiven("ranked lists " + lists.checksum, fingerprints_);
  return {images_, std::move(lists.ranking)};
}

void ImageRanker::Export(const ImageVectors& vectors) const {
  NamedVectors named;
  for (const ImageRecord& image : vectors.images) named.names.push_back(image.name);
  named.dim = vectors.dim;
  named.rows = vectors.rows;
  WriteNamedVectors(options_.export_path, named);
  messages_.info("Wrote the vectors to " + options_.export_path.string() + ".");
}

}  // namespace colmap_graphmatch
