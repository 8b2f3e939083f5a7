#include "colmap_graphmatch/graph/graph_builder.h"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"

namespace colmap_graphmatch {

GraphBuilder::GraphBuilder(const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                           const OnProgress& on_progress)
    : image_ids_(image_ids),
      verifier_(verifier),
      on_progress_(on_progress),
      graph_(image_ids.size()),
      components_(image_ids.size()) {
  if (!std::is_sorted(image_ids.begin(), image_ids.end())) {
    throw OptionsError("The ids of the images must be in ascending order.");
  }
}

std::vector<TestedVertexPair> GraphBuilder::KnownOutsideGraph() const {
  std::vector<TestedVertexPair> pairs;
  for (const VerifiedPair& known : verifier_.KnownPairs()) {
    const auto a = std::lower_bound(image_ids_.begin(), image_ids_.end(), known.pair.id1);
    const auto b = std::lower_bound(a, image_ids_.end(), known.pair.id2);
    if (b == image_ids_.end() || *a != known.pair.id1 || *b != known.pair.id2 || a == b) {
      continue;  // An image without features, or one that is gone.
    }
    const VertexPair pair(static_cast<Vertex>(a - image_ids_.begin()),
                          static_cast<Vertex>(b - image_ids_.begin()));
    if (graph_.IsTested(pair.first, pair.second)) continue;
    pairs.push_back({pair, known.outcome == PairOutcome::kEdge});
  }
  return pairs;
}

bool GraphBuilder::AddKnown(PairProposer& proposer) {
  return AddSeeds(KnownOutsideGraph(), proposer);
}

bool GraphBuilder::AddKnown(const std::vector<ImagePair>& pairs, PairProposer& proposer) {
  std::vector<TestedVertexPair> seeds = KnownOutsideGraph();
  const auto is_listed = [&](const TestedVertexPair& known) {
    return std::binary_search(
        pairs.begin(), pairs.end(),
        ImagePair(image_ids_[known.pair.first], image_ids_[known.pair.second]));
  };
  seeds.erase(std::remove_if(seeds.begin(), seeds.end(), std::not_fn(is_listed)), seeds.end());
  return AddSeeds(seeds, proposer);
}

void GraphBuilder::Tell(const TestedVertexPair& pair, PairProposer& proposer) {
  proposer.OnVerified(pair, [this, &pair]() -> const FeatureMatches& {
    return verifier_.Inliers(ImagePair(image_ids_[pair.pair.first], image_ids_[pair.pair.second]));
  });
}

bool GraphBuilder::AddSeeds(const std::vector<TestedVertexPair>& seeds, PairProposer& proposer) {
  for (const TestedVertexPair& seed : seeds) {
    Tell(seed, proposer);
    if (!seed.is_edge) continue;
    ++result_.num_seed_edges;
    components_.AddEdge(seed.pair);
  }
  result_.num_seed_pairs += seeds.size();
  graph_.Add(seeds);
  return !seeds.empty();
}

StageStatistics GraphBuilder::Verify(const Proposal& proposal, PairProposer& proposer) {
  const std::vector<VertexPair>& pairs = proposal.pairs;
  if (std::adjacent_find(pairs.begin(), pairs.end(), std::greater_equal<>()) != pairs.end()) {
    throw std::logic_error("The pairs of a proposal must ascend, each once.");
  }
  StageStatistics batch;
  const Stopwatch stopwatch;
  const ExpectedTests after =
      on_progress_ ? proposer.TestsAfter(proposal, graph_) : ExpectedTests();
  std::vector<ImagePair> image_pairs;
  image_pairs.reserve(pairs.size());
  for (const VertexPair& pair : pairs) {
    image_pairs.emplace_back(image_ids_[pair.first], image_ids_[pair.second]);
  }
  // Vertices ascend with image ids, so the pairs do too and can be found again by bisection.
  std::vector<TestedVertexPair> tested;
  tested.reserve(pairs.size());
  StageStatistics& total = result_.stages[proposal.stage];
  const StageStatistics before = total;
  result_.finished = verifier_.Verify(image_pairs, [&](const VerifiedPair& verified) {
    const auto place = std::lower_bound(image_pairs.begin(), image_pairs.end(), verified.pair);
    const VertexPair pair = pairs[static_cast<std::size_t>(place - image_pairs.begin())];
    const bool is_edge = verified.outcome == PairOutcome::kEdge;
    if (verified.is_known) {
      ++batch.num_known;
      if (is_edge) ++batch.num_known_edges;
    } else if (verified.outcome == PairOutcome::kFailed) {
      ++batch.num_failed;
      result_.failed_pairs.push_back(verified.pair);
    } else {
      ++batch.num_tested;
      if (is_edge) ++batch.num_edges;
    }
    if (is_edge) components_.AddEdge(pair);
    tested.push_back({pair, is_edge});
    Tell(tested.back(), proposer);
    batch.seconds = stopwatch.Seconds();
    total = before + batch;
    LoopProgress progress;
    progress.stage = proposal.stage;
    progress.iteration = proposal.iteration;
    progress.last = verified;
    const auto num_left = static_cast<double>(pairs.size() - tested.size());
    const bool is_sampling = proposal.stage == LoopStage::kSampling;
    progress.expected_remaining_samples =
        static_cast<std::size_t>(after.samples + (is_sampling ? num_left : 0));
    progress.expected_remaining_tests = static_cast<std::size_t>(num_left + after.all);
    Report(progress, batch.num_edges + batch.num_known_edges);
  });
  batch.seconds = stopwatch.Seconds();
  total = before + batch;
  KeepIteration(proposal, batch);
  std::sort(tested.begin(), tested.end(),
            [](const TestedVertexPair& a, const TestedVertexPair& b) { return a.pair < b.pair; });
  graph_.Add(tested);
  return batch;
}

void GraphBuilder::KeepIteration(const Proposal& proposal, const StageStatistics& batch) {
  if (proposal.stage != LoopStage::kSampling && proposal.stage != LoopStage::kPropagation) return;
  std::vector<IterationStatistics>& iterations = result_.iterations;
  if (iterations.empty() || iterations.back().iteration != proposal.iteration) {
    iterations.push_back({proposal.iteration, {}});
  }
  iterations.back().stages[proposal.stage] = batch;
}

void GraphBuilder::Report(LoopProgress progress, std::size_t num_edges_in_batch) {
  if (!on_progress_) return;
  progress.all = result_.stages.All();
  progress.num_edges = graph_.NumEdges() + num_edges_in_batch;
  progress.num_components = components_.Count();
  progress.largest_component = components_.Largest();
  progress.num_isolated = components_.NumIsolated();
  on_progress_(progress);
}

ExplorationResult GraphBuilder::Finish() {
  result_.graph = std::move(graph_);
  result_.num_components = components_.Count();
  result_.largest_component = components_.Largest();
  result_.num_isolated = components_.NumIsolated();
  std::sort(result_.failed_pairs.begin(), result_.failed_pairs.end());
  return std::move(result_);
}

}  // namespace colmap_graphmatch
