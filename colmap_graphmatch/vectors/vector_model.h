#pragma once

#include <optional>

#include "colmap_graphmatch/database/sqlite.h"
#include "colmap_graphmatch/encoding/gmm.h"
#include "colmap_graphmatch/encoding/pca.h"
#include "colmap_graphmatch/encoding/vocabulary.h"

namespace colmap_graphmatch {

// What was learnt from a collection to describe its images with.
struct VectorModel {
  Pca pca;                  // Of the descriptors, before the mixture; empty without one.
  GaussianMixture mixture;  // Without components where images are not described by it.
  Vocabulary vocabulary;    // Without words where there are none; else the other two are empty.
};

// The bytes that are kept for the next run (docs/formats.md).
sqlite::Blob Serialize(const VectorModel& model);

// What a model must look like to be of use.
struct VectorModelShape {
  int max_num_components = 0;
  int pca_dim = 0;  // 0: no PCA.
  bool is_vocabulary = false;
};

// Nothing if the bytes cannot be such a model over SIFT descriptors.
std::optional<VectorModel> Deserialize(const sqlite::Blob& blob, const VectorModelShape& shape);

}  // namespace colmap_graphmatch
