#include "colmap_graphmatch/graph/best_first.h"

#include <algorithm>
#include <utility>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

// The nearest images of each: tested to begin with, and candidates at any time later.
constexpr std::size_t kNumFirst = 1;
constexpr std::size_t kNumNearest = 4;
// Small batches choose best. A share of what was tested keeps the number of batches small, and
// cost 1 to 3 % more tests on 569 photos.
constexpr std::size_t kMinBatch = 100;
constexpr std::size_t kTestsPerPairOfBatch = 20;
// Tests after the first batch for each pair in it, as a guess.
constexpr double kTestsPerFirst = 12;

bool IsBeforePair(const Candidate& candidate, const VertexPair& pair) {
  return candidate.pair < pair;
}

}  // namespace

BestFirstProposer::BestFirstProposer(const BestFirstOptions& options, const Ranking& ranking,
                                     ThreadPool& threads)
    : options_(options),
      ranking_(ranking),
      evidence_(ranking, options_.restrictions, threads),
      tracks_(ranking.NumVertices()) {
  options.Check();
}

std::optional<Proposal> BestFirstProposer::Next(const MatchingGraph& graph) {
  if (graph.NumVertices() != ranking_.NumVertices()) {
    throw OptionsError("Every ranked image needs its id.");
  }
  Proposal proposal;
  proposal.iteration = num_batches_;
  proposal.stage = tested_.empty() ? LoopStage::kSampling : LoopStage::kLikeliest;
  proposed_ = tested_.empty() ? evidence_.Collect(kNumFirst, graph, tracks_) : Likeliest(graph);
  if (proposed_.empty()) return std::nullopt;
  ++num_batches_;
  if (tested_.empty()) expected_.all = kTestsPerFirst * static_cast<double>(proposed_.size());
  are_edges_.assign(proposed_.size(), false);
  proposal.pairs.reserve(proposed_.size());
  for (const Candidate& candidate : proposed_) proposal.pairs.push_back(candidate.pair);
  return proposal;
}

std::vector<Candidate> BestFirstProposer::Likeliest(const MatchingGraph& graph) {
  model_.Fit(tested_);
  const std::vector<Candidate> candidates = evidence_.Collect(kNumNearest, graph, tracks_);
  std::vector<std::pair<double, std::size_t>> likely;  // Of equal ones the smaller pair first.
  double num_edges = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const double probability = model_.Probability(candidates[i].cues);
    if (probability < options_.min_edge_probability && !candidates[i].is_of_lonely) continue;
    likely.emplace_back(-probability, i);
    num_edges += probability;
  }
  const std::size_t num =
      std::min(likely.size(), std::max(kMinBatch, graph.NumTested() / kTestsPerPairOfBatch));
  // Every edge makes about one more pair likely.
  expected_.all = static_cast<double>(likely.size() - num) + num_edges;
  const auto end = likely.begin() + static_cast<std::ptrdiff_t>(num);
  std::nth_element(likely.begin(), end, likely.end());
  std::vector<Candidate> likeliest;
  likeliest.reserve(num);
  std::for_each(likely.begin(), end,
                [&](const auto& entry) { likeliest.push_back(candidates[entry.second]); });
  std::sort(likeliest.begin(), likeliest.end(),
            [](const Candidate& a, const Candidate& b) { return a.pair < b.pair; });
  return likeliest;
}

void BestFirstProposer::OnVerified(const TestedVertexPair& pair, const InlierReader& inliers) {
  if (pair.is_edge) tracks_.Add(pair.pair, inliers());
  const auto found = std::lower_bound(proposed_.begin(), proposed_.end(), pair.pair, IsBeforePair);
  if (found == proposed_.end() || found->pair != pair.pair) {
    joining_.push_back(pair);
  } else {
    are_edges_[static_cast<std::size_t>(found - proposed_.begin())] = pair.is_edge;
  }
}

void BestFirstProposer::OnTested(const StageStatistics& /*batch*/) {
  for (std::size_t i = 0; i < proposed_.size(); ++i) {
    tested_.push_back({proposed_[i].cues, are_edges_[i]});
  }
  proposed_.clear();
  ForgetOldTests();
}

void BestFirstProposer::ForgetOldTests() {
  if (tested_.size() < 2 * EdgeModel::kMaxTests) return;
  tested_.erase(tested_.begin(), tested_.end() - static_cast<std::ptrdiff_t>(EdgeModel::kMaxTests));
}

void BestFirstProposer::OnKnown(const MatchingGraph& graph) {
  std::sort(joining_.begin(), joining_.end(),
            [](const TestedVertexPair& a, const TestedVertexPair& b) { return a.pair < b.pair; });
  const std::vector<LabelledCues> known = evidence_.Describe(joining_, graph, tracks_);
  tested_.insert(tested_.end(), known.begin(), known.end());
  joining_.clear();
  ForgetOldTests();
}

ExpectedTests BestFirstProposer::TestsAfter(const Proposal& /*proposal*/,
                                            const MatchingGraph& /*graph*/) const {
  return expected_;
}

}  // namespace colmap_graphmatch
