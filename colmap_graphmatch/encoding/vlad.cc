#include "colmap_graphmatch/encoding/vlad.h"

#include <cmath>

namespace colmap_graphmatch {

VladEncoder::VladEncoder(const GaussianMixture& mixture)
    : centres_(mixture.means.cast<float>()),
      half_squares_(centres_.rowwise().squaredNorm().transpose() / 2) {}

Eigen::VectorXf VladEncoder::Encode(const Eigen::Ref<const RowMatrixXf>& descriptors) const {
  // The nearest centre has the greatest x.mu - |mu|^2 / 2.
  const RowMatrixXf nearness = (descriptors * centres_.transpose()).rowwise() - half_squares_;
  RowMatrixXd sums = RowMatrixXd::Zero(centres_.rows(), centres_.cols());
  for (Eigen::Index i = 0; i < descriptors.rows(); ++i) {
    Eigen::Index nearest = 0;
    nearness.row(i).maxCoeff(&nearest);
    sums.row(nearest) += (descriptors.row(i) - centres_.row(nearest)).cast<double>();
  }
  Eigen::VectorXd vector = Eigen::Map<const Eigen::VectorXd>(sums.data(), sums.size());
  vector = vector.array().sign() * vector.array().abs().sqrt();
  const double norm = vector.norm();
  if (norm > 0) vector /= norm;
  return vector.cast<float>();
}

}  // namespace colmap_graphmatch
