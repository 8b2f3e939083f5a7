#include "colmap_graphmatch/vectors/options.h"

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/encoding/vocabulary.h"

namespace colmap_graphmatch {

const char* NameOfVectors(ImageVectorOptions::Descriptor descriptor) {
  switch (descriptor) {
    case ImageVectorOptions::Descriptor::kFisher:
      return "Fisher vectors";
    case ImageVectorOptions::Descriptor::kVlad:
      return "VLAD";
    case ImageVectorOptions::Descriptor::kGist:
      return "GIST";
    case ImageVectorOptions::Descriptor::kAsmk:
      return "visual words";
    case ImageVectorOptions::Descriptor::kFile:
      break;
  }
  return "vectors";
}

const char* NameOfModel(ImageVectorOptions::Descriptor descriptor) {
  return descriptor == ImageVectorOptions::Descriptor::kAsmk ? "vocabulary" : "mixture";
}

void ImageVectorOptions::Check() const {
  gmm.Check();
  if (pca_dim < 0 || pca_dim > kDescriptorDim) {
    throw OptionsError("pca_dim is " + std::to_string(pca_dim) +
                       "; it must be at most 128, or 0 for no PCA.");
  }
  if (descriptor == Descriptor::kGist && image_path.empty()) {
    throw OptionsError("GIST describes the photos themselves: give --image_path, where they are.");
  }
  if ((descriptor == Descriptor::kFile) != !vectors_path.empty()) {
    throw OptionsError(
        "--GraphMatching.descriptor file and --GraphMatching.vectors_path belong together: give "
        "both or none.");
  }
  if (num_training_descriptors < 1) {
    throw OptionsError("num_training_descriptors is " + std::to_string(num_training_descriptors) +
                       "; the mixture needs at least 1.");
  }
  if (max_num_features < 1) {
    throw OptionsError("max_num_features is " + std::to_string(max_num_features) +
                       "; an image vector needs at least 1.");
  }
}

std::string ImageVectorOptions::Key(std::uint64_t seed) const {
  // Does not compile if a field is forgotten.
  const auto& [described_by, photos, vectors, dim, mixture, num_training, num_features] = *this;
  if (described_by == Descriptor::kAsmk) return "visual words, " + VocabularyOptions().Key(seed);
  // The seed is there twice, as in the state files that there are.
  return "descriptor " + std::to_string(static_cast<int>(described_by)) + ", PCA " +
         std::to_string(dim) + ", " + mixture.Key(seed) + ", training " +
         std::to_string(num_training) + ", features " + std::to_string(num_features) + ", seed " +
         std::to_string(seed);
}

void ImageRankingOptions::Check() const {
  vectors.Check();
  const bool given = vectors.descriptor == ImageVectorOptions::Descriptor::kFile;
  if (!export_path.empty() && export_path.extension() != ".npy") {
    throw OptionsError("--GraphMatching.export_vectors is " + export_path.string() +
                       "; its name must end in .npy (the names go beside it, into .txt).");
  }
  if (!ranking_path.empty() && vectors.descriptor != ImageVectorOptions().descriptor) {
    throw OptionsError(
        "--GraphMatching.ranking_path and --GraphMatching.descriptor contradict each other: give "
        "one of them.");
  }
  if (!export_path.empty() && (given || !ranking_path.empty())) {
    throw OptionsError(
        "--GraphMatching.export_vectors writes vectors that this program makes: there are none "
        "with --GraphMatching.ranking_path or --GraphMatching.vectors_path.");
  }
  if (!export_path.empty() && vectors.descriptor == ImageVectorOptions::Descriptor::kAsmk) {
    throw OptionsError(
        "--GraphMatching.export_vectors writes a row of numbers for each image, and "
        "visual words are none: add --GraphMatching.descriptor fisher.");
  }
}

}  // namespace colmap_graphmatch
