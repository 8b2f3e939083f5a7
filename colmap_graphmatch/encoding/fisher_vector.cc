#include "colmap_graphmatch/encoding/fisher_vector.h"

#include <cmath>

namespace colmap_graphmatch {

FisherVectorEncoder::FisherVectorEncoder(const GaussianMixture& mixture)
    : mixture_(mixture), evaluator_(mixture) {}

Eigen::Index FisherVectorEncoder::Dim() const {
  return 2 * mixture_.NumComponents() * mixture_.Dim();
}

Eigen::VectorXd FisherVectorEncoder::Gradient(
    const Eigen::Ref<const RowMatrixXf>& descriptors) const {
  const Eigen::Index num_components = mixture_.NumComponents();
  const Eigen::Index dim = mixture_.Dim();
  SufficientStatistics sums(num_components, dim);
  evaluator_.Accumulate(descriptors, &sums);

  Eigen::VectorXd gradient(Dim());
  const auto num_descriptors = static_cast<double>(descriptors.rows());
  for (Eigen::Index k = 0; k < num_components; ++k) {
    const Eigen::ArrayXd mean = (mixture_.means.row(k) - evaluator_.Origin()).array();
    const Eigen::ArrayXd variance = mixture_.variances.row(k).array();
    const Eigen::ArrayXd s1 = sums.s1.row(k).array();
    const Eigen::ArrayXd s2 = sums.s2.row(k).array();
    const double s0 = sums.s0[k];
    const double scale = 1 / (num_descriptors * std::sqrt(mixture_.weights[k]));
    gradient.segment(k * dim, dim) = scale * (s1 - s0 * mean) / variance.sqrt();
    gradient.segment((num_components + k) * dim, dim) =
        scale / std::sqrt(2.0) * ((s2 - 2 * mean * s1 + s0 * mean.square()) / variance - s0);
  }
  return gradient;
}

Eigen::VectorXf FisherVectorEncoder::Encode(
    const Eigen::Ref<const RowMatrixXf>& descriptors) const {
  Eigen::VectorXd vector = Gradient(descriptors);
  vector = vector.array().sign() * vector.array().abs().sqrt();
  const double norm = vector.norm();
  if (norm > 0) vector /= norm;
  return vector.cast<float>();
}

}  // namespace colmap_graphmatch
