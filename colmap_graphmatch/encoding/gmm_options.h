#pragma once

#include <cstdint>
#include <string>

namespace colmap_graphmatch {

// Of the mixture of Gaussians, with diagonal covariances, that EM learns.
struct GmmOptions {
  // K. More components describe finer differences and cost proportionally more time and memory: the
  // Fisher vector of an image has 2 K D entries. Paper: 16 ("We used 16 centroids") of D = 128.
  int num_components = 64;

  // EM stops when the log-likelihood grows by less than this fraction of itself, or after
  // max_num_iterations.
  double tolerance = 1e-5;
  int max_num_iterations = 100;

  // Smallest variance of a component in any dimension, in units of the samples squared (descriptors
  // have unit length).
  double variance_floor = 1e-4;

  // Names the values of all fields, and the seed: equal for what gives equal mixtures alone.
  std::string Key(std::uint64_t seed) const;

  // Throws OptionsError.
  void Check() const;
};

}  // namespace colmap_graphmatch
