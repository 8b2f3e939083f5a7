#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/enum_words.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/encoding/gmm.h"
#include "colmap_graphmatch/pipeline/vector_model.h"

namespace colmap_graphmatch {

struct ImageVectorOptions {
  // kFisher: Fisher vectors of SIFT features (encoding/fisher_vector.h). For comparison kVlad: VLAD
  // under the same mixture (encoding/vlad.h), kGist: GIST of the photos (encoding/gist.h), kFile:
  // vectors that another program made (given_vectors.h).
  enum class Descriptor { kFisher, kVlad, kGist, kFile };
  Descriptor descriptor = Descriptor::kFisher;

  // Where the photos are, for kGist.
  std::filesystem::path image_path;

  // Where the vectors are, for kFile.
  std::filesystem::path vectors_path;

  // PCA of the features to so many dimensions before the mixture, at most 128; 0: none. The paper
  // has none, and 16 components: with as many entries a vector, 64 components in 32 dimensions find
  // more edges in as many tests (docs/evaluation.md).
  int pca_dim = 32;

  GmmOptions gmm;

  // Descriptors that the mixture is learnt from, the same number from every image (at least one,
  // all if it has fewer), drawn at random. More cost proportionally more time and 512 bytes each.
  int num_training_descriptors = 100000;

  // Descriptors an image that are encoded at most: those of the largest scales. Paper: 1,000.
  int max_num_features = 1000;

  std::uint64_t seed = 0;

  // Names the values of all fields but the paths: their contents count, not where they are.
  std::string Key() const;

  // Throws OptionsError.
  void Check() const;
};

inline constexpr EnumWords<ImageVectorOptions::Descriptor, 4> kDescriptorWords = {
    {{ImageVectorOptions::Descriptor::kFisher, "fisher"},
     {ImageVectorOptions::Descriptor::kVlad, "vlad"},
     {ImageVectorOptions::Descriptor::kGist, "gist"},
     {ImageVectorOptions::Descriptor::kFile, "file"}}};

bool HasMixture(ImageVectorOptions::Descriptor descriptor);

struct VectorModelTraining {
  VectorModel model;
  std::size_t num_iterations = 0;  // Of EM.
  bool converged = false;
};

// Learns what images are described with from images that all have features. Reads every image's
// descriptors once and keeps the drawn ones alone. Nothing is learnt for kGist and kFile. Throws
// StoppedError if stop asks for it.
VectorModelTraining LearnVectorModel(const ImageVectorOptions& options, Database& database,
                                     const std::vector<ImageRecord>& images, ThreadPool& threads,
                                     const StopRequest& stop);

// The length of the vectors.
std::size_t VectorDim(const ImageVectorOptions& options, const VectorModel& model);

// The vectors of the images, all of which must have features: a row of VectorDim floats each. Reads
// the next images while it encodes the last ones. Throws FileError if a photo is needed and cannot
// be read.
std::vector<float> EncodeImages(const ImageVectorOptions& options, const VectorModel& model,
                                Database& database, const std::vector<ImageRecord>& images,
                                ThreadPool& threads, const StopRequest& stop);

}  // namespace colmap_graphmatch
