#pragma once

#include <Eigen/Core>

#include "colmap_graphmatch/encoding/gmm.h"
#include "colmap_graphmatch/encoding/matrix.h"

namespace colmap_graphmatch {

// Encodes the descriptors of one image as an improved Fisher vector (Perronnin, Sanchez and
// Mensink, ECCV 2010; GraphMatch, section 3.1). Thread-safe.
class FisherVectorEncoder {
 public:
  explicit FisherVectorEncoder(const GaussianMixture& mixture);

  // 2 K D.
  Eigen::Index Dim() const;

  // The Fisher vector before normalisation, of descriptors x_i (N x D, N >= 1):
  //   u_k = 1/(N sqrt(pi_k))   sum_i q_ik (x_i - mu_k) / sigma_k
  //   v_k = 1/(N sqrt(2 pi_k)) sum_i q_ik [((x_i - mu_k) / sigma_k)^2 - 1]
  // all u_k first, then all v_k. It tends to zero for samples of the mixture itself.
  Eigen::VectorXd Gradient(const Eigen::Ref<const RowMatrixXf>& descriptors) const;

  // Gradient, then sign(z) sqrt|z| per entry, then scaled to unit length; all zero if the gradient
  // is.
  Eigen::VectorXf Encode(const Eigen::Ref<const RowMatrixXf>& descriptors) const;

 private:
  GaussianMixture mixture_;
  GmmEvaluator evaluator_;
};

}  // namespace colmap_graphmatch
