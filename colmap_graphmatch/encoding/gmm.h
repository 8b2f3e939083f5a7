#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/encoding/gmm_options.h"
#include "colmap_graphmatch/encoding/matrix.h"

namespace colmap_graphmatch {

// A mixture of K Gaussians with diagonal covariances in D dimensions.
struct GaussianMixture {
  Eigen::VectorXd weights;  // K, positive, sum 1: pi_k.
  RowMatrixXd means;        // K x D: mu_k.
  RowMatrixXd variances;    // K x D, at least GmmOptions::variance_floor: sigma_k^2.

  Eigen::Index NumComponents() const { return means.rows(); }
  Eigen::Index Dim() const { return means.cols(); }
};

struct GmmTraining {
  GaussianMixture mixture;
  // Mean log-likelihood of a sample before each update; it never falls, except after an empty
  // component was replaced.
  std::vector<double> log_likelihoods;
  int num_replaced_components = 0;
  bool converged = false;
};

// Fits a mixture to samples (N x D, one a row, N >= 1, finite) by expectation maximisation from a
// k-means++ start (Arthur and Vassilvitskii, SODA 2007). A component that no sample belongs to any
// more is placed beside the widest one. With fewer than K different samples found by the start, the
// mixture has fewer components. seed: of the start. The result is bitwise the same for any number
// of threads. Throws OptionsError; StoppedError if stop (may be null) asks for it.
GmmTraining TrainGmm(const GmmOptions& options, std::uint64_t seed, const RowMatrixXf& samples,
                     ThreadPool& threads, const StopRequest* stop = nullptr);

// Sums over samples x_i with responsibilities q_ik, the common ground of EM and of the Fisher
// vector.
struct SufficientStatistics {
  double log_likelihood = 0;  // sum_i log p(x_i)
  Eigen::VectorXd s0;         // K: sum_i q_ik
  RowMatrixXd s1;             // K x D: sum_i q_ik (x_i - origin)
  RowMatrixXd s2;             // K x D: sum_i q_ik (x_i - origin)^2

  SufficientStatistics(Eigen::Index num_components, Eigen::Index dim);
  void Add(const SufficientStatistics& other);
};

// Evaluates responsibilities in the log domain: log q_ik = log pi_k + log N(x_i; mu_k, sigma_k^2)
// minus the log of their sum over k, the maximum subtracted first.
//
// Works on samples relative to an origin near their mean: the quadratic form is expanded into
// matrix products in single precision, and without the shift the terms would cancel.
class GmmEvaluator {
 public:
  explicit GmmEvaluator(const GaussianMixture& mixture);

  const Eigen::RowVectorXd& Origin() const { return origin_; }

  // Adds the statistics of the given rows, in blocks of a fixed size, so that sums are formed in
  // the same order whoever calls.
  void Accumulate(const Eigen::Ref<const RowMatrixXf>& samples, SufficientStatistics* sums) const;

 private:
  friend class GmmEvaluatorPeer;  // Of the tests.

  // N x K; every row sums to 1.
  RowMatrixXf Responsibilities(const Eigen::Ref<const RowMatrixXf>& samples) const;
  // Fills values with x - origin and (x - origin)^2 of a block of samples (N x 2 D) and
  // responsibilities (N x K), both padded by columns; returns the sum of the log-likelihoods.
  double EvaluateBlock(const Eigen::Ref<const RowMatrixXf>& samples, RowMatrixXf* values,
                       RowMatrixXf* responsibilities) const;

  Eigen::RowVectorXd origin_;        // D
  Eigen::RowVectorXf origin_float_;  // D
  RowMatrixXf coefficients_;  // Of x and of x^2 in log(pi_k N(x; k)): 2 D x K, padded with zeros.
  Eigen::RowVectorXf constants_;  // K
};

}  // namespace colmap_graphmatch
