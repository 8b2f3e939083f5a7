#pragma once

#include <Eigen/Core>

#include "colmap_graphmatch/encoding/gmm.h"
#include "colmap_graphmatch/encoding/matrix.h"

namespace colmap_graphmatch {

// Encodes the descriptors of one image as a vector of locally aggregated descriptors (Jegou et al.,
// CVPR 2010), with the means of a mixture as centres, for comparison with Fisher vectors.
// Thread-safe.
class VladEncoder {
 public:
  explicit VladEncoder(const GaussianMixture& mixture);

  // K D.
  Eigen::Index Dim() const { return centres_.size(); }

  // Of descriptors x_i (N x D, N >= 1): for every centre the sum of x_i - mu_k over the descriptors
  // that are nearest to it (of equally near ones the first), then sign(z) sqrt|z| per entry, then
  // scaled to unit length, like the Fisher vector; all zero if the sums are.
  Eigen::VectorXf Encode(const Eigen::Ref<const RowMatrixXf>& descriptors) const;

 private:
  RowMatrixXf centres_;              // K x D
  Eigen::RowVectorXf half_squares_;  // K: |mu_k|^2 / 2
};

}  // namespace colmap_graphmatch
