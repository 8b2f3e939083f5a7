#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace colmap_graphmatch {

// What is known of a pair before it is tested (graph/pair_evidence.h), as numbers of about the size
// of 1; the first is always 1.
inline constexpr std::size_t kNumCues = 15;
using Cues = std::array<double, kNumCues>;

struct LabelledCues {
  Cues cues;
  bool is_edge = false;
};

// The probability that a pair is an edge, by logistic regression.
class EdgeModel {
 public:
  // Tests that are looked at, the last ones: more than enough for so few coefficients, and most
  // like those to come.
  static constexpr std::size_t kMaxTests = 20000;

  // Fits it to pairs that were tested, in their order, by Newton's method with a weak pull of all
  // coefficients towards zero: so it also works where all are edges, or none. Deterministic.
  void Fit(const std::vector<LabelledCues>& tested);

  double Probability(const Cues& cues) const;
  const Cues& Coefficients() const { return coefficients_; }

 private:
  Cues coefficients_ = {};
};

}  // namespace colmap_graphmatch
