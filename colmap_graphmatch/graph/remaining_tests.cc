#include "colmap_graphmatch/graph/remaining_tests.h"

#include <algorithm>

#include "colmap_graphmatch/graph/propagation.h"

namespace colmap_graphmatch {
namespace {

// Of pairs that were asked for, earlier runs' included; `without_pairs` if there were none.
double EdgesPerPair(const StageStatistics& stage, double without_pairs) {
  const std::size_t num_pairs = stage.num_tested + stage.num_known;
  if (num_pairs == 0) return without_pairs;
  return static_cast<double>(stage.num_edges + stage.num_known_edges) /
         static_cast<double>(num_pairs);
}

}  // namespace

void RemainingTests::OnSampling(int iteration, std::size_t num_pairs, std::size_t num_drawn) {
  iteration_ = iteration;
  // Of the draws to come ever fewer coincide.
  sampling_batch_ = static_cast<double>(num_pairs + num_drawn) / 2;
  if (num_pairs == 0) last_sampling_ = {};
}

void RemainingTests::OnPropagation(int iteration, std::size_t num_pairs) {
  iteration_ = iteration;
  if (num_pairs == 0) last_propagation_ = {};
}

void RemainingTests::OnTested(LoopStage stage, const StageStatistics& batch) {
  (stage == LoopStage::kSampling ? last_sampling_ : last_propagation_) = batch;
}

ExpectedTests RemainingTests::After(const Proposal& proposal, const MatchingGraph& graph) const {
  ExpectedTests expected;
  // In later iterations.
  expected.samples =
      std::max(options_.number_sample_iterations - iteration_ - 1, 0) * sampling_batch_;
  expected.all = expected.samples;
  if (options_.num_to_propagate == 0) return expected;
  // In the end propagation tests every open pair of today, and each edge among them opens about one
  // more; edges are as frequent as they were last. To begin with there are hardly any open pairs:
  // each edge that sampling is still to find leads to a test at least, up to a share.
  constexpr double kLeastPropagation = 0.6;
  const double share = std::min(EdgesPerPair(last_sampling_, kLeastPropagation), kLeastPropagation);
  const double edges_per_pair = EdgesPerPair(last_sampling_ + last_propagation_, 0);
  const auto num_open = static_cast<double>(CountOpenPairs(options_, graph, threads_));
  const auto num_proposed =
      static_cast<double>(proposal.stage == LoopStage::kPropagation ? proposal.pairs.size() : 0);
  expected.all +=
      std::max(num_open * (1 + edges_per_pair) - num_proposed, share * expected.samples);
  return expected;
}

}  // namespace colmap_graphmatch
