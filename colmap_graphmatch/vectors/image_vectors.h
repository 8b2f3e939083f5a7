#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/visual_words.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/vectors/options.h"
#include "colmap_graphmatch/vectors/vector_model.h"

namespace colmap_graphmatch {

bool HasMixture(ImageVectorOptions::Descriptor descriptor);

struct VectorModelTraining {
  VectorModel model;
  std::size_t num_iterations = 0;  // Of EM.
  bool converged = false;
};

// Learns what images are described with from images that all have features. Reads every image's
// descriptors once and keeps the drawn ones alone. seed: of what is drawn. Nothing is learnt for
// kGist and kFile. Throws StoppedError if stop asks for it.
VectorModelTraining LearnVectorModel(const ImageVectorOptions& options, std::uint64_t seed,
                                     Database& database, const std::vector<ImageRecord>& images,
                                     ThreadPool& threads, const StopRequest& stop);

// The length of the vectors; 0 for kAsmk, which has none, and kFile.
std::size_t VectorDim(const ImageVectorOptions& options, const VectorModel& model);

// The vectors of the images, all of which must have features: a row of VectorDim floats each. Reads
// the next images while it encodes the last ones. Throws FileError if a photo is needed and cannot
// be read.
std::vector<float> EncodeImages(const ImageVectorOptions& options, const VectorModel& model,
                                Database& database, const std::vector<ImageRecord>& images,
                                ThreadPool& threads, const StopRequest& stop);

// The same for kAsmk: the visual words of all features of each image.
std::vector<VisualWords> EncodeImagesAsWords(const VectorModel& model, Database& database,
                                             const std::vector<ImageRecord>& images,
                                             ThreadPool& threads, const StopRequest& stop);

}  // namespace colmap_graphmatch
