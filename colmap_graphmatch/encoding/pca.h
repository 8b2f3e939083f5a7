#pragma once

#include <Eigen/Core>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/encoding/matrix.h"

namespace colmap_graphmatch {

// Principal component analysis of descriptors. The components are not whitened: the mixture scales
// every dimension by its own variance anyway.
struct Pca {
  Eigen::VectorXd mean;  // D
  RowMatrixXd basis;     // d x D, orthonormal rows, by descending variance.

  // N x d: basis (x - mean) for every row x of N x D.
  RowMatrixXf Project(const Eigen::Ref<const RowMatrixXf>& samples) const;
};

// Learns it from samples (N x D, N >= 1). dim: d, at least 1 and at most D, else OptionsError. The
// sign of every component makes its entry of largest magnitude positive. Bitwise the same for any
// number of threads.
Pca LearnPca(const RowMatrixXf& samples, int dim, ThreadPool& threads);

}  // namespace colmap_graphmatch
