#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/encoding/gmm.h"
#include "colmap_graphmatch/encoding/matrix.h"

// The formulas of the encoding as they are written in its headers, in double precision with one
// loop an index, and samples of mixtures to try them on.

namespace colmap_graphmatch {

// Does not depend on the standard library in use, unlike std::normal_distribution.
inline double Normal(Random* random) {
  const double radius = std::sqrt(-2 * std::log(1 - random->Uniform()));
  return radius * std::cos(2 * 3.14159265358979323846 * random->Uniform());
}

// Means in a cube of half the given size around `offset`, standard deviations from 0.5 to 1.5.
inline GaussianMixture RandomMixture(Eigen::Index num_components, Eigen::Index dim, double size,
                                     double offset, Random* random) {
  GaussianMixture mixture;
  mixture.weights.resize(num_components);
  mixture.means.resize(num_components, dim);
  mixture.variances.resize(num_components, dim);
  for (Eigen::Index k = 0; k < num_components; ++k) {
    mixture.weights[k] = 0.5 + random->Uniform();
    for (Eigen::Index d = 0; d < dim; ++d) {
      mixture.means(k, d) = offset + size * (random->Uniform() - 0.5);
      mixture.variances(k, d) = std::pow(0.5 + random->Uniform(), 2);
    }
  }
  mixture.weights /= mixture.weights.sum();
  return mixture;
}

inline RowMatrixXf SampleMixture(const GaussianMixture& mixture, Eigen::Index num_samples,
                                 Random* random) {
  RowMatrixXf samples(num_samples, mixture.Dim());
  for (Eigen::Index i = 0; i < num_samples; ++i) {
    double remaining = random->Uniform();
    Eigen::Index k = 0;
    while (k + 1 < mixture.NumComponents() && remaining >= mixture.weights[k]) {
      remaining -= mixture.weights[k];
      ++k;
    }
    for (Eigen::Index d = 0; d < mixture.Dim(); ++d) {
      samples(i, d) = static_cast<float>(mixture.means(k, d) +
                                         std::sqrt(mixture.variances(k, d)) * Normal(random));
    }
  }
  return samples;
}

// Non-negative vectors of unit length as SIFT makes them: most entries near zero, none above 0.2
// before the last normalisation, quantised to 1/512 and clipped to one byte. They gather around
// some prototypes.
inline RowMatrixXf SampleSiftLike(Eigen::Index num_samples, Random* random) {
  constexpr Eigen::Index kDim = 128;
  constexpr Eigen::Index kNumPrototypes = 8;
  RowMatrixXd prototypes(kNumPrototypes, kDim);
  for (Eigen::Index p = 0; p < kNumPrototypes; ++p) {
    for (Eigen::Index d = 0; d < kDim; ++d) {
      prototypes(p, d) = std::pow(Normal(random), 2);
    }
  }
  RowMatrixXf samples(num_samples, kDim);
  for (Eigen::Index i = 0; i < num_samples; ++i) {
    const auto prototype = static_cast<Eigen::Index>(random->Index(kNumPrototypes));
    Eigen::RowVectorXd sample(kDim);
    for (Eigen::Index d = 0; d < kDim; ++d) {
      sample[d] = std::max(0.0, prototypes(prototype, d) + 0.5 * Normal(random));
    }
    sample = sample.normalized().cwiseMin(0.2).normalized();
    for (Eigen::Index d = 0; d < kDim; ++d) {
      samples(i, d) = static_cast<float>(std::min(255.0, std::round(512 * sample[d])) / 512);
    }
  }
  return samples;
}

// log(pi_k N(x; mu_k, sigma_k^2)).
inline double ReferenceLogJoint(const GaussianMixture& mixture, Eigen::Index k,
                                const Eigen::RowVectorXf& sample) {
  double sum = std::log(mixture.weights[k]);
  for (Eigen::Index d = 0; d < mixture.Dim(); ++d) {
    const double difference = static_cast<double>(sample[d]) - mixture.means(k, d);
    const double variance = mixture.variances(k, d);
    sum -= 0.5 *
           (std::log(2 * 3.14159265358979323846 * variance) + difference * difference / variance);
  }
  return sum;
}

inline double ReferenceLogLikelihood(const GaussianMixture& mixture,
                                     const Eigen::RowVectorXf& sample) {
  double maximum = -INFINITY;
  for (Eigen::Index k = 0; k < mixture.NumComponents(); ++k) {
    maximum = std::max(maximum, ReferenceLogJoint(mixture, k, sample));
  }
  double sum = 0;
  for (Eigen::Index k = 0; k < mixture.NumComponents(); ++k) {
    sum += std::exp(ReferenceLogJoint(mixture, k, sample) - maximum);
  }
  return maximum + std::log(sum);
}

inline double ReferenceMeanLogLikelihood(const GaussianMixture& mixture,
                                         const RowMatrixXf& samples) {
  double sum = 0;
  for (Eigen::Index i = 0; i < samples.rows(); ++i) {
    sum += ReferenceLogLikelihood(mixture, samples.row(i));
  }
  return sum / static_cast<double>(samples.rows());
}

inline RowMatrixXd ReferenceResponsibilities(const GaussianMixture& mixture,
                                             const RowMatrixXf& samples) {
  RowMatrixXd responsibilities(samples.rows(), mixture.NumComponents());
  for (Eigen::Index i = 0; i < samples.rows(); ++i) {
    const double log_likelihood = ReferenceLogLikelihood(mixture, samples.row(i));
    for (Eigen::Index k = 0; k < mixture.NumComponents(); ++k) {
      responsibilities(i, k) =
          std::exp(ReferenceLogJoint(mixture, k, samples.row(i)) - log_likelihood);
    }
  }
  return responsibilities;
}

// One iteration of EM.
inline GaussianMixture ReferenceEmStep(const GaussianMixture& mixture, const RowMatrixXf& samples,
                                       double variance_floor) {
  const RowMatrixXd responsibilities = ReferenceResponsibilities(mixture, samples);
  GaussianMixture next = mixture;
  for (Eigen::Index k = 0; k < mixture.NumComponents(); ++k) {
    double weight = 0;
    for (Eigen::Index i = 0; i < samples.rows(); ++i) weight += responsibilities(i, k);
    next.weights[k] = weight / static_cast<double>(samples.rows());
    for (Eigen::Index d = 0; d < mixture.Dim(); ++d) {
      double mean = 0;
      for (Eigen::Index i = 0; i < samples.rows(); ++i) {
        mean += responsibilities(i, k) * static_cast<double>(samples(i, d)) / weight;
      }
      double variance = 0;
      for (Eigen::Index i = 0; i < samples.rows(); ++i) {
        const double difference = static_cast<double>(samples(i, d)) - mean;
        variance += responsibilities(i, k) * difference * difference / weight;
      }
      next.means(k, d) = mean;
      next.variances(k, d) = std::max(variance, variance_floor);
    }
  }
  return next;
}

// The Fisher vector before normalisation.
inline Eigen::VectorXd ReferenceGradient(const GaussianMixture& mixture,
                                         const RowMatrixXf& descriptors) {
  const RowMatrixXd responsibilities = ReferenceResponsibilities(mixture, descriptors);
  const Eigen::Index num_components = mixture.NumComponents();
  const Eigen::Index dim = mixture.Dim();
  const auto num_descriptors = static_cast<double>(descriptors.rows());
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(2 * num_components * dim);
  for (Eigen::Index k = 0; k < num_components; ++k) {
    for (Eigen::Index d = 0; d < dim; ++d) {
      double u = 0;
      double v = 0;
      for (Eigen::Index i = 0; i < descriptors.rows(); ++i) {
        const double z = (static_cast<double>(descriptors(i, d)) - mixture.means(k, d)) /
                         std::sqrt(mixture.variances(k, d));
        u += responsibilities(i, k) * z;
        v += responsibilities(i, k) * (z * z - 1);
      }
      gradient[k * dim + d] = u / (num_descriptors * std::sqrt(mixture.weights[k]));
      gradient[(num_components + k) * dim + d] =
          v / (num_descriptors * std::sqrt(2 * mixture.weights[k]));
    }
  }
  return gradient;
}

inline Eigen::VectorXd ReferenceFisherVector(const GaussianMixture& mixture,
                                             const RowMatrixXf& descriptors) {
  Eigen::VectorXd vector = ReferenceGradient(mixture, descriptors);
  double squared_norm = 0;
  for (double& z : vector) {
    squared_norm += std::abs(z);
    z = std::copysign(std::sqrt(std::abs(z)), z);
  }
  return vector / std::sqrt(squared_norm);
}

}  // namespace colmap_graphmatch
