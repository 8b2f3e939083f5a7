#include "colmap_graphmatch/graph/options.h"

#include <algorithm>
#include <string>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/exact_text.h"

namespace colmap_graphmatch {
namespace {

void CheckAtLeast(const char* name, int value, int minimum) {
  if (value < minimum) {
    throw OptionsError(std::string("GraphMatching.") + name + " is " + std::to_string(value) +
                       "; it must be at least " + std::to_string(minimum) + ".");
  }
}

}  // namespace

int GraphMatchOptions::MaxTestsForSampling(std::size_t num_images) const {
  if (max_tests_for_sampling > 0) return max_tests_for_sampling;
  return static_cast<int>(std::max(std::min(0.017 * static_cast<double>(num_images), 120.0), 10.0));
}

int GraphMatchOptions::TestsInIteration(int iteration, std::size_t num_images) const {
  if (iteration < 0 || iteration >= number_sample_iterations) return 0;
  return std::max(1, MaxTestsForSampling(num_images) / number_sample_iterations);
}

std::string GraphMatchOptions::Key() const {
  // Does not compile if a field is forgotten.
  const auto& [iterations, neighbors, propagated, tests, failed, pairs] = *this;
  return "iterations " + std::to_string(iterations) + ", neighbors " + std::to_string(neighbors) +
         ", propagated " + std::to_string(propagated) + ", tests " + std::to_string(tests) +
         ", failed " + std::to_string(failed) + ", " + pairs.Key();
}

void GraphMatchOptions::Check() const {
  CheckAtLeast("number_sample_iterations", number_sample_iterations, 0);
  CheckAtLeast("max_num_neighbors", max_num_neighbors, 1);
  CheckAtLeast("num_to_propagate", num_to_propagate, 0);
  CheckAtLeast("max_tests_for_sampling", max_tests_for_sampling, 0);
  CheckAtLeast("max_failed_samples", max_failed_samples, 0);
}

std::string BestFirstOptions::Key() const {
  // Does not compile if a field is forgotten.
  const auto& [aim, probability, pairs] = *this;
  return "probability " + ExactText(probability) + ", " + pairs.Key() +
         (aim == Goal::kEdges ? "" : ", goal " + std::to_string(static_cast<int>(aim)));
}

void BestFirstOptions::Check() const {
  if (!(min_edge_probability > 0 && min_edge_probability < 1)) {
    throw OptionsError("GraphMatching.min_edge_probability is " +
                       std::to_string(min_edge_probability) +
                       "; it must be greater than 0 and less than 1.");
  }
}

}  // namespace colmap_graphmatch
