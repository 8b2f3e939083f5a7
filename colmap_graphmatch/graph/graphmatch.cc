#include "colmap_graphmatch/graph/graphmatch.h"

#include <algorithm>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/graph/components.h"
#include "colmap_graphmatch/graph/propagation.h"
#include "colmap_graphmatch/graph/sampling.h"

namespace colmap_graphmatch {
namespace {

bool ByPair(const TestedVertexPair& a, const TestedVertexPair& b) { return a.pair < b.pair; }

class Loop {
 public:
  Loop(const GraphMatchOptions& options, const Ranking& ranking,
       const std::vector<ImageId>& image_ids, PairVerifier& verifier, ThreadPool& threads,
       const std::function<void(const LoopProgress&)>& on_progress)
      : options_(options),
        ranking_(ranking),
        image_ids_(image_ids),
        verifier_(verifier),
        threads_(threads),
        on_progress_(on_progress),
        sampler_(options, ranking, threads),
        graph_(ranking.NumVertices()),
        components_(ranking.NumVertices()) {}

  // When what is known becomes part of the graph without having been asked for.
  enum class Seeding { kNever, kAtTheEnd, kAtTheStart };

  GraphMatchResult Run(Seeding seeding) {
    if (seeding == Seeding::kAtTheStart) Seed();
    for (iteration_ = 0; result_.finished; ++iteration_) {
      result_.iterations.emplace_back();
      const bool sampled = Sample();
      const bool propagated = result_.finished && Propagate();
      if (sampled || propagated) continue;
      result_.iterations.pop_back();
      if (!sampling_over_ && options_.MoreTestsAfterEmpty(iteration_, ranking_.NumVertices())) {
        continue;
      }
      // What is known and was not asked for may still lead on.
      if (seeding == Seeding::kNever || !Seed()) break;
    }
    result_.graph = std::move(graph_);
    result_.num_components = components_.Count();
    result_.largest_component = components_.Largest();
    result_.num_isolated = components_.NumIsolated();
    std::sort(result_.failed_pairs.begin(), result_.failed_pairs.end());
    return std::move(result_);
  }

  // The known pairs of ranked images that are not in the graph.
  std::vector<TestedVertexPair> KnownOutsideGraph() const {
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

 private:
  bool Sample() {
    if (sampling_over_) return false;
    const std::vector<VertexPair> pairs = sampler_.Propose(iteration_, graph_);
    sampler_.Charge();
    stage_ = LoopStage::kSampling;
    Verify(pairs, &result_.sampling, &result_.iterations.back().sampling);
    const StageStatistics& found = result_.iterations.back().sampling;
    sampling_over_ =
        options_.stop_sampling_without_edges && found.num_edges + found.num_known_edges == 0;
    return !pairs.empty();
  }

  bool Propagate() {
    const std::vector<VertexPair> pairs = colmap_graphmatch::Propagate(
        options_, ranking_, graph_, options_.propagate_from_new_edges_only ? first_new_edge_ : 0,
        threads_);
    first_new_edge_ = graph_.NumEdges();
    stage_ = LoopStage::kPropagation;
    Verify(pairs, &result_.propagation, &result_.iterations.back().propagation);
    return !pairs.empty();
  }

  // Adds what is known to the graph. Returns true if that changed it.
  bool Seed() {
    const std::vector<TestedVertexPair> seeds = KnownOutsideGraph();
    for (const TestedVertexPair& seed : seeds) {
      if (!seed.is_edge) continue;
      ++result_.num_seed_edges;
      components_.AddEdge(seed.pair);
    }
    result_.num_seed_pairs += seeds.size();
    graph_.Add(seeds);
    sampler_.ChargeTested(graph_);
    return !seeds.empty();
  }

  void Verify(const std::vector<VertexPair>& pairs, StageStatistics* total,
              StageStatistics* of_iteration) {
    if (pairs.empty()) return;
    const Stopwatch stopwatch;
    std::vector<ImagePair> image_pairs;
    image_pairs.reserve(pairs.size());
    for (const VertexPair& pair : pairs) image_pairs.push_back(ToImagePair(pair));
    // Vertices ascend with image ids, so the pairs do too and can be found again by bisection.
    std::vector<TestedVertexPair> tested;
    tested.reserve(pairs.size());
    const StageStatistics before = *total;
    const double future_tests = ExpectedTestsAfterThisBatch();
    StageStatistics batch;
    result_.finished = verifier_.Verify(image_pairs, [&](const VerifiedPair& verified) {
      const auto place = std::lower_bound(image_pairs.begin(), image_pairs.end(), verified.pair);
      const VertexPair pair = pairs[static_cast<std::size_t>(place - image_pairs.begin())];
      const bool is_edge = verified.outcome == PairOutcome::kEdge;
      if (FindPair(verifier_.KnownPairs(), verified.pair) != nullptr) {
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
      batch.seconds = stopwatch.Seconds();
      *total = before + batch;
      Report(batch.num_edges + batch.num_known_edges,
             static_cast<double>(pairs.size() - tested.size()) + future_tests);
    });
    batch.seconds = stopwatch.Seconds();
    *total = before + batch;
    *of_iteration = batch;
    std::sort(tested.begin(), tested.end(), ByPair);
    graph_.Add(tested);
  }

  // As many in each iteration to come as in the last whole one. They shrink, so this is rather too
  // much.
  double ExpectedTestsAfterThisBatch() const {
    const int num_iterations = options_.number_sample_iterations - iteration_ - 1;
    if (num_iterations <= 0 || sampling_over_) return 0;
    if (result_.iterations.size() < 2) {
      // Two images often draw each other; propagation tests about as much as sampling.
      return 1.6 * num_iterations * static_cast<double>(ranking_.NumVertices()) *
             options_.TestsInIteration(iteration_, ranking_.NumVertices());
    }
    const IterationStatistics& last = result_.iterations[result_.iterations.size() - 2];
    const StageStatistics all = last.sampling + last.propagation;
    return static_cast<double>(num_iterations) *
           static_cast<double>(all.num_tested + all.num_known + all.num_failed);
  }

  void Report(std::size_t num_edges_in_batch, double expected_remaining_tests) {
    if (!on_progress_) return;
    LoopProgress progress;
    progress.stage = stage_;
    progress.iteration = iteration_;
    progress.sampling = result_.sampling;
    progress.propagation = result_.propagation;
    progress.num_edges = graph_.NumEdges() + num_edges_in_batch;
    progress.num_components = components_.Count();
    progress.largest_component = components_.Largest();
    progress.num_isolated = components_.NumIsolated();
    progress.expected_remaining_tests = static_cast<std::size_t>(expected_remaining_tests);
    on_progress_(progress);
  }

  ImagePair ToImagePair(const VertexPair& pair) const {
    return {image_ids_[pair.first], image_ids_[pair.second]};
  }

  const GraphMatchOptions& options_;
  const Ranking& ranking_;
  const std::vector<ImageId>& image_ids_;
  PairVerifier& verifier_;
  ThreadPool& threads_;
  const std::function<void(const LoopProgress&)>& on_progress_;

  Sampler sampler_;
  MatchingGraph graph_;
  Components components_;
  bool sampling_over_ = false;
  std::size_t first_new_edge_ = 0;
  int iteration_ = 0;
  LoopStage stage_ = LoopStage::kSampling;
  GraphMatchResult result_;
};

// Answers what was known before the run and takes everything else for no edge.
class KnownOnly : public PairVerifier {
 public:
  explicit KnownOnly(const PairVerifier& verifier) : known_(verifier.KnownPairs()) {}

  const std::vector<VerifiedPair>& KnownPairs() const override { return known_; }

  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override {
    for (const ImagePair& pair : pairs) {
      const VerifiedPair* known = FindPair(known_, pair);
      on_verified(known != nullptr ? *known : VerifiedPair{pair, PairOutcome::kNoEdge, 0});
    }
    return true;
  }

 private:
  const std::vector<VerifiedPair>& known_;
};

}  // namespace

StageStatistics operator+(const StageStatistics& a, const StageStatistics& b) {
  StageStatistics sum;
  sum.num_tested = a.num_tested + b.num_tested;
  sum.num_edges = a.num_edges + b.num_edges;
  sum.num_failed = a.num_failed + b.num_failed;
  sum.num_known = a.num_known + b.num_known;
  sum.num_known_edges = a.num_known_edges + b.num_known_edges;
  sum.seconds = a.seconds + b.seconds;
  return sum;
}

GraphMatchResult RunGraphMatch(const GraphMatchOptions& options, const Ranking& ranking,
                               const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                               ThreadPool& threads,
                               const std::function<void(const LoopProgress&)>& on_progress) {
  options.Check();
  if (image_ids.size() != ranking.NumVertices() ||
      !std::is_sorted(image_ids.begin(), image_ids.end())) {
    throw OptionsError("Every ranked image needs its id, in ascending order.");
  }
  // Would a run from the start ask for all that is known? Then an earlier run of this loop tested
  // it, and this one goes the same way again, up to where that one ended. Otherwise others did, and
  // it seeds the graph.
  Loop::Seeding seeding = Loop::Seeding::kAtTheEnd;
  if (!verifier.KnownPairs().empty()) {
    const std::function<void(const LoopProgress&)> silent;
    KnownOnly known_only(verifier);
    Loop rehearsal(options, ranking, image_ids, known_only, threads, silent);
    const std::size_t num_known = rehearsal.KnownOutsideGraph().size();
    const GraphMatchResult rehearsed = rehearsal.Run(Loop::Seeding::kNever);
    const StageStatistics asked = rehearsed.sampling + rehearsed.propagation;
    if (asked.num_known < num_known) seeding = Loop::Seeding::kAtTheStart;
  }
  return Loop(options, ranking, image_ids, verifier, threads, on_progress).Run(seeding);
}

}  // namespace colmap_graphmatch
