#include "colmap_graphmatch/vectors/checkpoint.h"

#include <boost/crc.hpp>
#include <cstring>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/vectors/asmk_blobs.h"

namespace colmap_graphmatch {
namespace {

std::string Checksum(const void* data, std::size_t size) {
  boost::crc_32_type crc;
  crc.process_bytes(data, size);
  return std::to_string(crc.checksum());
}

}  // namespace

Checkpoint::Checkpoint(const std::filesystem::path& database_path,
                       const sqlite::LockPatience& patience, const Messages& messages)
    : messages_(messages) {
  try {
    try {
      file_ = std::make_unique<StateFile>(database_path, 0);
    } catch (const DatabaseLockedError&) {
      if (patience.seconds <= 0) throw;
      messages_.info("Another graphmatch_matcher works on this database; waiting for it, up to " +
                     std::to_string(static_cast<long>(patience.seconds)) +
                     " s (--GraphMatching.lock_timeout).");
      file_ = std::make_unique<StateFile>(database_path, patience);
    }
    usable_ = true;
  } catch (const DatabaseLockedError&) {
    throw;
  } catch (const DatabaseError& error) {
    messages_.warn(
        std::string("What this run computes will not be kept for the next one, and nothing keeps "
                    "another graphmatch_matcher from the database. ") +
        error.what());
  }
}

void Checkpoint::Try(const std::function<void()>& action) {
  if (!usable_) return;
  try {
    try {
      action();
    } catch (const sqlite::DamagedFileError&) {
      messages_.warn(file_->Path().string() +
                     " is damaged and is made anew: what the last run kept is computed again.");
      file_->MakeAnew();
    }
  } catch (const DatabaseError& error) {
    // The file stays open: its lock keeps other runs away.
    usable_ = false;
    messages_.warn(std::string("What this run computes will not be kept for the next one. ") +
                   error.what());
  }
}

void Checkpoint::Select(const ImageVectorOptions& options, std::uint64_t seed,
                        std::vector<ImageFingerprint> images, const std::string& photos_checksum) {
  images_ = std::move(images);
  if (options.descriptor == ImageVectorOptions::Descriptor::kGist) {
    shape_ = VectorModelShape();
    vectors_key_ = "GIST of " + photos_checksum;
    return;
  }
  shape_ = {options.gmm.num_components, options.pca_dim,
            options.descriptor == ImageVectorOptions::Descriptor::kAsmk};
  vectors_key_ = options.Key(seed);
}

void Checkpoint::SelectGiven(const std::string& ranking_key, std::vector<ImageFingerprint> images) {
  images_ = std::move(images);
  vectors_key_ = ranking_key;
}

std::vector<ImageId> Checkpoint::FindChanged() {
  std::vector<ImageId> changed;
  Try([&] { changed = file_->FindChanged(images_); });
  return changed;
}

std::optional<VectorModel> Checkpoint::ReadModel() {
  std::optional<VectorModel> model;
  Try([&] {
    if (file_->CountVectors(images_) * 2 < images_.size()) return;
    const std::optional<sqlite::Blob> blob = file_->ReadMixture(vectors_key_);
    if (!blob) return;
    model = Deserialize(*blob, shape_);
    model_checksum_ = Checksum(blob->data(), blob->size());
  });
  return model;
}

void Checkpoint::KeepModel(const VectorModel& model) {
  Try([&] {
    const sqlite::Blob blob = Serialize(model);
    model_checksum_ = Checksum(blob.data(), blob.size());
    file_->WriteMixture(vectors_key_, blob);
  });
}

std::vector<bool> Checkpoint::ReadVectors(std::size_t dim, float* vectors) {
  std::vector<bool> found(images_.size());
  const auto take = [&](std::size_t i, const std::uint8_t* data, std::size_t size) {
    if (size != dim * sizeof(float)) return false;
    std::memcpy(vectors + i * dim, data, size);
    return true;
  };
  Try([&] { found = file_->ReadVectors(images_, take); });
  return found;
}

void Checkpoint::KeepVectors(const std::vector<std::size_t>& which, std::size_t dim,
                             const float* vectors) {
  Keep(which, [&](std::size_t i) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(vectors + i * dim);
    return sqlite::Blob(bytes, bytes + dim * sizeof(float));
  });
}

std::vector<bool> Checkpoint::ReadWords(std::size_t num_words, std::vector<VisualWords>* words) {
  std::vector<bool> found(images_.size());
  const auto take = [&](std::size_t i, const std::uint8_t* data, std::size_t size) {
    std::optional<VisualWords> kept = DeserializeWords(data, size, num_words);
    if (!kept) return false;
    (*words)[i] = std::move(*kept);
    return true;
  };
  Try([&] { found = file_->ReadVectors(images_, take); });
  return found;
}

void Checkpoint::KeepWords(const std::vector<std::size_t>& which,
                           const std::vector<VisualWords>& words) {
  Keep(which, [&](std::size_t i) { return Serialize(words[i]); });
}

void Checkpoint::Keep(const std::vector<std::size_t>& which,
                      const std::function<sqlite::Blob(std::size_t i)>& vector_of) {
  std::vector<ImageFingerprint> images;
  images.reserve(which.size());
  for (const std::size_t i : which) images.push_back(images_[i]);
  Try([&] {
    if (!dropped_others_) file_->DropVectorsExcept(images_);
    dropped_others_ = true;
    file_->WriteVectors(images, vector_of);
  });
}

std::string Checkpoint::SeedsKey(const std::string& loop_key) const {
  boost::crc_32_type crc;
  for (const ImageFingerprint& image : images_) {
    crc.process_bytes(&image.id, sizeof(image.id));
    crc.process_bytes(&image.features, sizeof(image.features));
  }
  return loop_key + ", " + vectors_key_ + ", mixture " + model_checksum_ + ", images " +
         std::to_string(images_.size()) + " " + std::to_string(crc.checksum());
}

std::vector<ImagePair> Checkpoint::ReadSeeds(const std::string& loop_key) {
  Try([&] { kept_seeds_ = file_->ReadSeeds(SeedsKey(loop_key)); });
  return kept_seeds_.value_or(std::vector<ImagePair>());
}

void Checkpoint::KeepSeeds(const std::string& loop_key, const std::vector<ImagePair>& seeds) {
  if (kept_seeds_ == seeds) return;
  Try([&] { file_->WriteSeeds(SeedsKey(loop_key), seeds); });
}

}  // namespace colmap_graphmatch
