#include "colmap_graphmatch/graph/best_first.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

// The nearest images of each: tested to begin with, and candidates at any time later.
constexpr std::size_t kNumFirst = 1;
constexpr std::size_t kNumNearest = 2;
// Of each kind of prior. The first batch has none: it shows what they are worth.
constexpr std::size_t kNumNear = 2;
// Small batches choose best, and large ones keep many cores busy: with half of these 0.99 of the
// edges of 569 photos take 1 % fewer tests, with twice as many 1.5 % more. A share of what was
// tested keeps the number of batches small.
constexpr std::size_t kMinBatch = 100;
constexpr std::size_t kTestsPerPairOfBatch = 20;
// Tests after the first batch for each pair in it, as a guess.
constexpr double kTestsPerFirst = 12;

// From so many neighbours of both images on, and so many of them in common, an edge more hardly
// changes a model.
constexpr std::size_t kEnoughNeighbors = 10;
constexpr std::size_t kEnoughInCommon = 4;

bool HasEnoughWithout(const Candidate& candidate, const MatchingGraph& graph) {
  const auto& [a, b] = candidate.pair;
  return candidate.num_common >= kEnoughInCommon &&
         std::min(graph.Degree(a), graph.Degree(b)) >= kEnoughNeighbors;
}

struct LikelyPair {
  double probability = 0;
  VertexPair pair;
};

bool IsLikelier(const LikelyPair& a, const LikelyPair& b) {
  return std::tie(b.probability, a.pair) < std::tie(a.probability, b.pair);
}

}  // namespace

BestFirstProposer::BestFirstProposer(const BestFirstOptions& options, const Ranking& ranking,
                                     const ImagePriors& priors, ThreadPool& threads)
    : options_(options),
      ranking_(ranking),
      threads_(threads),
      evidence_(ranking, priors, options_.restrictions, threads),
      tracks_(ranking.NumVertices()) {
  options.Check();
}

std::optional<Proposal> BestFirstProposer::Next(const MatchingGraph& graph) {
  if (graph.NumVertices() != ranking_.NumVertices()) {
    throw OptionsError("Every ranked image needs its id.");
  }
  TakeNote(graph);
  Proposal proposal;
  proposal.iteration = num_batches_;
  if (tested_.empty()) {
    proposal.stage = LoopStage::kSampling;
    proposal.pairs = Likeliest(std::numeric_limits<std::size_t>::max(), kNumFirst, 0, 0, graph);
    expected_.all = kTestsPerFirst * static_cast<double>(proposal.pairs.size());
  } else {
    proposal.stage = LoopStage::kLikeliest;
    model_.Fit(tested_);
    proposal.pairs = Likeliest(std::max(kMinBatch, graph.NumTested() / kTestsPerPairOfBatch),
                               kNumNearest, kNumNear, options_.min_edge_probability, graph);
  }
  if (proposal.pairs.empty()) return std::nullopt;
  ++num_batches_;
  pairs_ = proposal.pairs;
  proposed_.resize(pairs_.size());
  threads_.ParallelFor(pairs_.size(),
                       [&](std::size_t i) { proposed_[i] = {evidence_.Of(pairs_[i], graph)}; });
  return proposal;
}

std::vector<VertexPair> BestFirstProposer::Likeliest(std::size_t num, std::size_t num_nearest,
                                                     std::size_t num_near, double min_probability,
                                                     const MatchingGraph& graph) {
  const bool is_for_model = options_.goal == BestFirstOptions::Goal::kModel;
  std::vector<std::vector<LikelyPair>> parts(evidence_.NumTasks());
  evidence_.VisitCandidates(num_nearest, num_near, graph,
                            [&](std::size_t task, const Candidate& candidate) {
                              const double probability = model_.Probability(candidate.cues);
                              if (probability < min_probability && !candidate.is_of_lonely) return;
                              if (is_for_model && HasEnoughWithout(candidate, graph)) return;
                              parts[task].push_back({probability, candidate.pair});
                            });
  std::vector<LikelyPair> likely;
  double num_edges = 0;
  for (std::vector<LikelyPair>& part : parts) {
    for (const LikelyPair& pair : part) num_edges += pair.probability;
    likely.insert(likely.end(), part.begin(), part.end());
    part = {};
  }
  num = std::min(num, likely.size());
  // Every edge makes about one more pair likely.
  expected_.all = static_cast<double>(likely.size() - num) + num_edges;
  std::nth_element(likely.begin(), likely.begin() + static_cast<std::ptrdiff_t>(num), likely.end(),
                   IsLikelier);
  std::vector<VertexPair> likeliest(num);
  for (std::size_t i = 0; i < num; ++i) likeliest[i] = likely[i].pair;
  std::sort(likeliest.begin(), likeliest.end());
  return likeliest;
}

void BestFirstProposer::OnVerified(const TestedVertexPair& pair, const InlierReader& inliers) {
  if (pair.is_edge) tracks_.Add(pair.pair, inliers());
  joining_.push_back(pair);
  const auto found = std::lower_bound(pairs_.begin(), pairs_.end(), pair.pair);
  if (found == pairs_.end() || *found != pair.pair) {
    known_.push_back(pair);
  } else {
    proposed_[static_cast<std::size_t>(found - pairs_.begin())].is_edge = pair.is_edge;
  }
}

void BestFirstProposer::OnTested(const StageStatistics& /*batch*/) {
  Learn(proposed_);
  pairs_.clear();
}

void BestFirstProposer::OnKnown(const MatchingGraph& graph) {
  TakeNote(graph);
  std::sort(known_.begin(), known_.end(),
            [](const TestedVertexPair& a, const TestedVertexPair& b) { return a.pair < b.pair; });
  Learn(evidence_.WithoutThem(known_, graph, tracks_));
  known_.clear();
}

void BestFirstProposer::TakeNote(const MatchingGraph& graph) {
  evidence_.Add(joining_, graph, tracks_);
  joining_.clear();
}

void BestFirstProposer::Learn(const std::vector<LabelledCues>& tests) {
  tested_.insert(tested_.end(), tests.begin(), tests.end());
  // The model looks at no more.
  if (tested_.size() < 2 * EdgeModel::kMaxTests) return;
  tested_.erase(tested_.begin(), tested_.end() - static_cast<std::ptrdiff_t>(EdgeModel::kMaxTests));
}

ExpectedTests BestFirstProposer::TestsAfter(const Proposal& /*proposal*/,
                                            const MatchingGraph& /*graph*/) const {
  return expected_;
}

}  // namespace colmap_graphmatch
