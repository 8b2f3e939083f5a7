#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/encoding/gmm.h"

namespace colmap_graphmatch {

struct ImageVectorOptions {
  GmmOptions gmm;

  // Descriptors that the mixture is learnt from, the same number from every image (at least one,
  // all if it has fewer), drawn at random. More cost proportionally more time and 512 bytes each.
  int num_training_descriptors = 100000;

  // Descriptors an image that are encoded at most. Paper: 1,000.
  int max_num_features = 1000;

  // Which of them, if the image has more.
  enum class FeatureSelection { kLargestScales, kRandom };
  FeatureSelection feature_selection = FeatureSelection::kLargestScales;

  std::uint64_t seed = 0;

  // Throws OptionsError.
  void Check() const;
};

// Learns the mixture from the images, all of which must have features. Reads every image's
// descriptors once and keeps the drawn ones alone. Throws StoppedError if stop asks for it.
GmmTraining LearnMixture(const ImageVectorOptions& options, Database& database,
                         const std::vector<ImageRecord>& images, ThreadPool& threads,
                         const StopRequest& stop);

// The Fisher vectors of the images, all of which must have features: images.size() rows of 2 K D
// floats. Reads the next images while it encodes the last ones.
std::vector<float> EncodeImages(const ImageVectorOptions& options, const GaussianMixture& mixture,
                                Database& database, const std::vector<ImageRecord>& images,
                                ThreadPool& threads, const StopRequest& stop);

}  // namespace colmap_graphmatch
