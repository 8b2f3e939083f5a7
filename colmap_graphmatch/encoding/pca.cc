#include "colmap_graphmatch/encoding/pca.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

// Samples whose sums are formed by one task, in the same order on any number of threads.
constexpr Eigen::Index kBlockSize = 4096;

}  // namespace

RowMatrixXf Pca::Project(const Eigen::Ref<const RowMatrixXf>& samples) const {
  const RowMatrixXf basis_float = basis.cast<float>();
  const Eigen::RowVectorXf mean_float = mean.transpose().cast<float>();
  return (samples.rowwise() - mean_float) * basis_float.transpose();
}

Pca LearnPca(const RowMatrixXf& samples, int dim, ThreadPool& threads) {
  if (dim < 1 || dim > samples.cols()) {
    throw OptionsError("The principal components are " + std::to_string(dim) +
                       "; of samples with " + std::to_string(samples.cols()) +
                       " dimensions there are at least 1 and at most as many.");
  }
  const Eigen::Index num_blocks = (samples.rows() + kBlockSize - 1) / kBlockSize;
  const auto block_of = [&](std::size_t i) {
    const Eigen::Index first = static_cast<Eigen::Index>(i) * kBlockSize;
    return samples.middleRows(first, std::min(kBlockSize, samples.rows() - first));
  };
  const auto count = static_cast<std::size_t>(num_blocks);
  std::vector<Eigen::VectorXd> sums(count);
  threads.ParallelFor(count, [&](std::size_t i) {
    sums[i] = block_of(i).cast<double>().colwise().sum().transpose();
  });
  Pca pca;
  pca.mean = Eigen::VectorXd::Zero(samples.cols());
  for (const Eigen::VectorXd& sum : sums) pca.mean += sum;
  pca.mean /= static_cast<double>(samples.rows());

  std::vector<Eigen::MatrixXd> products(count);
  threads.ParallelFor(count, [&](std::size_t i) {
    const RowMatrixXd centred = block_of(i).cast<double>().rowwise() - pca.mean.transpose();
    products[i].noalias() = centred.transpose() * centred;
  });
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(samples.cols(), samples.cols());
  for (const Eigen::MatrixXd& product : products) covariance += product;
  covariance /= static_cast<double>(samples.rows());

  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  pca.basis = solver.eigenvectors().rowwise().reverse().leftCols(dim).transpose();
  for (Eigen::Index i = 0; i < dim; ++i) {
    Eigen::Index largest = 0;
    pca.basis.row(i).cwiseAbs().maxCoeff(&largest);
    if (pca.basis(i, largest) < 0) pca.basis.row(i) *= -1;
  }
  return pca;
}

}  // namespace colmap_graphmatch
