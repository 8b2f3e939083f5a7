#include "colmap_graphmatch/pipeline/run_state.h"

#include <algorithm>
#include <array>
#include <boost/crc.hpp>
#include <cstring>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"

namespace colmap_graphmatch {
namespace {

std::string Hex(double value) {
  std::array<char, 32> text = {};
  std::snprintf(text.data(), text.size(), "%a", value);
  return text.data();
}

// K and D, the weights, the means, the variances.
sqlite::Blob Serialize(const GaussianMixture& mixture) {
  const std::array<std::int64_t, 2> shape = {mixture.NumComponents(), mixture.Dim()};
  const auto size_of = [](const auto& matrix) {
    return static_cast<std::size_t>(matrix.size()) * sizeof(double);
  };
  sqlite::Blob blob(sizeof(shape) + size_of(mixture.weights) + size_of(mixture.means) +
                    size_of(mixture.variances));
  std::uint8_t* target = blob.data();
  const auto put = [&target](const void* data, std::size_t size) {
    std::memcpy(target, data, size);
    target += size;
  };
  put(shape.data(), sizeof(shape));
  put(mixture.weights.data(), size_of(mixture.weights));
  put(mixture.means.data(), size_of(mixture.means));
  put(mixture.variances.data(), size_of(mixture.variances));
  return blob;
}

// Nothing if it cannot be a mixture of at most max_num_components over SIFT descriptors.
std::optional<GaussianMixture> Deserialize(const sqlite::Blob& blob, int max_num_components) {
  std::array<std::int64_t, 2> shape = {};
  if (blob.size() < sizeof(shape)) return std::nullopt;
  std::memcpy(shape.data(), blob.data(), sizeof(shape));
  if (shape[0] < 1 || shape[0] > max_num_components || shape[1] != kDescriptorDim) {
    return std::nullopt;
  }
  const std::int64_t num_values = shape[0] * (1 + 2 * shape[1]);
  if (blob.size() != sizeof(shape) + static_cast<std::size_t>(num_values) * sizeof(double)) {
    return std::nullopt;
  }
  GaussianMixture mixture;
  mixture.weights.resize(shape[0]);
  mixture.means.resize(shape[0], shape[1]);
  mixture.variances.resize(shape[0], shape[1]);
  const std::uint8_t* source = blob.data() + sizeof(shape);
  const auto take = [&source](auto* matrix) {
    const std::size_t size = static_cast<std::size_t>(matrix->size()) * sizeof(double);
    std::memcpy(matrix->data(), source, size);
    source += size;
  };
  take(&mixture.weights);
  take(&mixture.means);
  take(&mixture.variances);
  const bool is_mixture = mixture.weights.allFinite() && mixture.means.allFinite() &&
                          mixture.variances.allFinite() && (mixture.weights.array() > 0).all() &&
                          (mixture.variances.array() > 0).all();
  return is_mixture ? std::optional<GaussianMixture>(std::move(mixture)) : std::nullopt;
}

std::string Checksum(const void* data, std::size_t size) {
  boost::crc_32_type crc;
  crc.process_bytes(data, size);
  return std::to_string(crc.checksum());
}

}  // namespace

RunState::RunState(const std::filesystem::path& database_path, double lock_timeout_seconds,
                   const StopRequest& stop, const Say& info, const Say& warn)
    : warn_(warn) {
  // SQLite's own waiting cannot be interrupted.
  constexpr double kSecondsATry = 0.2;
  const std::filesystem::path path = StateFile::PathFor(database_path);
  const Stopwatch waiting;
  try {
    for (bool told = false; !file_; told = true) {
      stop.ThrowIfRequested();
      const double left = lock_timeout_seconds - waiting.Seconds();
      try {
        file_ = std::make_unique<StateFile>(path, std::clamp(left, 0.0, told ? kSecondsATry : 0.0));
      } catch (const DatabaseLockedError&) {
        if (left <= 0) throw;
        if (!told) {
          info("Another graphmatch_matcher works on this database; waiting for it, up to " +
               std::to_string(static_cast<long>(lock_timeout_seconds)) +
               " s (--GraphMatching.lock_timeout).");
        }
      }
    }
    usable_ = true;
  } catch (const DatabaseLockedError&) {
    throw;
  } catch (const DatabaseError& error) {
    warn(std::string("What this run computes will not be kept for the next one, and nothing keeps "
                     "another graphmatch_matcher from the database. ") +
         error.what());
  }
}

void RunState::Try(const std::function<void()>& action) {
  if (!usable_) return;
  try {
    try {
      action();
    } catch (const sqlite::DamagedFileError&) {
      warn_(file_->Path().string() +
            " is damaged and is made anew: what the last run kept is computed again.");
      file_->MakeAnew();
    }
  } catch (const DatabaseError& error) {
    // The file stays open: its lock keeps other runs away.
    usable_ = false;
    warn_(std::string("What this run computes will not be kept for the next one. ") + error.what());
  }
}

void RunState::Select(const ImageVectorOptions& options, std::vector<ImageFingerprint> images) {
  images_ = std::move(images);
  const GmmOptions& gmm = options.gmm;
  max_num_components_ = gmm.num_components;
  vectors_key_ = "components " + std::to_string(gmm.num_components) + ", tolerance " +
                 Hex(gmm.tolerance) + ", iterations " + std::to_string(gmm.max_num_iterations) +
                 ", variance floor " + Hex(gmm.variance_floor) + ", training " +
                 std::to_string(options.num_training_descriptors) + ", features " +
                 std::to_string(options.max_num_features) + ", selection " +
                 std::to_string(static_cast<int>(options.feature_selection)) + ", seed " +
                 std::to_string(options.seed) + " " + std::to_string(gmm.seed);
}

void RunState::SelectGiven(const std::string& ranking_key, std::vector<ImageFingerprint> images) {
  images_ = std::move(images);
  vectors_key_ = ranking_key;
}

std::vector<ImageId> RunState::FindChanged() {
  std::vector<ImageId> changed;
  Try([&] { changed = file_->FindChanged(images_); });
  return changed;
}

std::optional<GaussianMixture> RunState::ReadMixture() {
  std::optional<GaussianMixture> mixture;
  Try([&] {
    if (file_->CountVectors(images_) * 2 < images_.size()) return;
    const std::optional<sqlite::Blob> blob = file_->ReadMixture(vectors_key_);
    if (!blob) return;
    mixture = Deserialize(*blob, max_num_components_);
    mixture_checksum_ = Checksum(blob->data(), blob->size());
  });
  return mixture;
}

void RunState::KeepMixture(const GaussianMixture& mixture) {
  Try([&] {
    const sqlite::Blob blob = Serialize(mixture);
    mixture_checksum_ = Checksum(blob.data(), blob.size());
    file_->WriteMixture(vectors_key_, blob);
  });
}

std::vector<bool> RunState::ReadVectors(std::size_t dim, float* vectors) {
  std::vector<bool> found(images_.size());
  Try([&] { found = file_->ReadVectors(images_, dim, vectors); });
  return found;
}

void RunState::KeepVectors(const std::vector<std::size_t>& which, std::size_t dim,
                           const float* vectors) {
  std::vector<ImageFingerprint> images;
  images.reserve(which.size());
  for (const std::size_t i : which) images.push_back(images_[i]);
  Try([&] {
    if (!dropped_others_) file_->DropVectorsExcept(images_);
    dropped_others_ = true;
    file_->WriteVectors(images, dim, vectors);
  });
}

std::string RunState::SeedsKey(const std::string& loop_key) const {
  boost::crc_32_type crc;
  for (const ImageFingerprint& image : images_) {
    crc.process_bytes(&image.id, sizeof(image.id));
    crc.process_bytes(&image.features, sizeof(image.features));
  }
  return loop_key + ", " + vectors_key_ + ", mixture " + mixture_checksum_ + ", images " +
         std::to_string(images_.size()) + " " + std::to_string(crc.checksum());
}

std::vector<ImagePair> RunState::ReadSeeds(const std::string& loop_key) {
  Try([&] { kept_seeds_ = file_->ReadSeeds(SeedsKey(loop_key)); });
  return kept_seeds_.value_or(std::vector<ImagePair>());
}

void RunState::KeepSeeds(const std::string& loop_key, const std::vector<ImagePair>& seeds) {
  if (kept_seeds_ == seeds) return;
  Try([&] { file_->WriteSeeds(SeedsKey(loop_key), seeds); });
}

}  // namespace colmap_graphmatch
