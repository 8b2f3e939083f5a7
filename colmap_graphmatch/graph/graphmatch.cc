#include "colmap_graphmatch/graph/graphmatch.h"

#include <algorithm>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/graph/graph_builder.h"
#include "colmap_graphmatch/graph/propagation.h"
#include "colmap_graphmatch/graph/sampling.h"

namespace colmap_graphmatch {
namespace {

// Of pairs that were asked for, earlier runs' included; `without_pairs` if there were none.
double EdgesPerPair(const StageStatistics& stage, double without_pairs) {
  const std::size_t num_pairs = stage.num_tested + stage.num_known;
  if (num_pairs == 0) return without_pairs;
  return static_cast<double>(stage.num_edges + stage.num_known_edges) /
         static_cast<double>(num_pairs);
}

class Loop {
 public:
  Loop(const GraphMatchOptions& options, const Ranking& ranking,
       const std::vector<ImageId>& image_ids, PairVerifier& verifier, ThreadPool& threads,
       const std::function<void(const LoopProgress&)>& on_progress)
      : options_(options),
        ranking_(ranking),
        threads_(threads),
        sampler_(options, ranking, threads),
        builder_(image_ids, verifier, on_progress),
        shows_progress_(static_cast<bool>(on_progress)) {}

  // Makes known pairs part of the graph.
  void Begin(const std::vector<ImagePair>& seeds) {
    if (!seeds.empty() && builder_.AddKnown(seeds)) sampler_.ChargeTested(builder_.Graph());
  }

  // add_known_at_the_end: what is known and was not asked for may still lead on.
  GraphMatchResult Run(bool add_known_at_the_end) {
    for (iteration_ = 0; builder_.Continues(); ++iteration_) {
      iterations_.push_back({iteration_, {}, {}});
      const bool sampled = Sample();
      const bool propagated = builder_.Continues() && Propagate();
      if (sampled || propagated) continue;
      iterations_.pop_back();
      if (!add_known_at_the_end || !builder_.AddKnown()) break;
      sampler_.ChargeTested(builder_.Graph());
    }
    // A run that was stopped may not have come to all of it.
    if (add_known_at_the_end) builder_.AddKnown();
    GraphMatchResult result = builder_.Finish();
    result.iterations = std::move(iterations_);
    return result;
  }

  std::size_t NumKnownOutsideGraph() const { return builder_.NumKnownOutsideGraph(); }

 private:
  bool Sample() {
    const std::vector<VertexPair> pairs = sampler_.Propose(iteration_, builder_.Graph());
    sampler_.Charge();
    // Of the draws to come ever fewer coincide.
    sampling_batch_ = static_cast<double>(pairs.size() + sampler_.NumDrawn()) / 2;
    last_sampling_ = builder_.Verify(LoopStage::kSampling, iteration_, pairs, ExpectedTestsAfter(0),
                                     ExpectedSamples());
    iterations_.back().sampling = last_sampling_;
    return !pairs.empty();
  }

  bool Propagate() {
    const std::vector<VertexPair> pairs =
        colmap_graphmatch::Propagate(options_, ranking_, builder_.Graph(), threads_);
    last_propagation_ = builder_.Verify(LoopStage::kPropagation, iteration_, pairs,
                                        ExpectedTestsAfter(pairs.size()), ExpectedSamples());
    iterations_.back().propagation = last_propagation_;
    return !pairs.empty();
  }

  // In later iterations.
  double ExpectedSamples() const {
    const int num_iterations = std::max(options_.number_sample_iterations - iteration_ - 1, 0);
    return num_iterations * sampling_batch_;
  }

  // After the batch that is tested next; num_propagated: its pairs, if propagation proposed them.
  double ExpectedTestsAfter(std::size_t num_propagated) const {
    if (!shows_progress_) return 0;
    const double sampling = ExpectedSamples();
    if (options_.num_to_propagate == 0) return sampling;
    // In the end propagation tests every open pair of today, and each edge among them opens about
    // one more; edges are as frequent as they were last. To begin with there are hardly any open
    // pairs: each edge that sampling is still to find leads to a test at least, up to a share.
    constexpr double kLeastPropagation = 0.6;
    const double share =
        std::min(EdgesPerPair(last_sampling_, kLeastPropagation), kLeastPropagation);
    const double edges_per_pair = EdgesPerPair(last_sampling_ + last_propagation_, 0);
    const auto num_open = static_cast<double>(CountOpenPairs(options_, builder_.Graph(), threads_));
    const double propagation = std::max(
        num_open * (1 + edges_per_pair) - static_cast<double>(num_propagated), share * sampling);
    return sampling + propagation;
  }

  const GraphMatchOptions& options_;
  const Ranking& ranking_;
  ThreadPool& threads_;
  Sampler sampler_;
  GraphBuilder builder_;
  bool shows_progress_;
  std::vector<IterationStatistics> iterations_;
  StageStatistics last_sampling_;
  StageStatistics last_propagation_;
  double sampling_batch_ = 0;  // Expected tests of each sampling to come.
  int iteration_ = 0;
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

void CheckInput(const GraphMatchOptions& options, const Ranking& ranking,
                const std::vector<ImageId>& image_ids) {
  options.Check();
  if (image_ids.size() != ranking.NumVertices()) {
    throw OptionsError("Every ranked image needs its id.");
  }
}

}  // namespace

const char* StageName(LoopStage stage) {
  switch (stage) {
    case LoopStage::kSampling:
      return "sampling";
    case LoopStage::kPropagation:
      return "propagation";
    case LoopStage::kRetrieval:
      return "retrieval";
    case LoopStage::kExpansion:
      return "expansion";
    case LoopStage::kListed:
      break;
  }
  return "listed";
}

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

std::vector<ImagePair> ChooseSeeds(const GraphMatchOptions& options, const Ranking& ranking,
                                   const std::vector<ImageId>& image_ids,
                                   const PairVerifier& verifier, ThreadPool& threads,
                                   const std::vector<ImagePair>& earlier_seeds) {
  CheckInput(options, ranking, image_ids);
  if (verifier.KnownPairs().empty()) return {};
  const auto asks_for_all_known = [&](const std::vector<ImagePair>& seeds) {
    const std::function<void(const LoopProgress&)> silent;
    KnownOnly known_only(verifier);
    Loop rehearsal(options, ranking, image_ids, known_only, threads, silent);
    rehearsal.Begin(seeds);
    const std::size_t num_known = rehearsal.NumKnownOutsideGraph();
    const GraphMatchResult rehearsed = rehearsal.Run(false);
    return (rehearsed.sampling + rehearsed.propagation).num_known == num_known;
  };
  if (!earlier_seeds.empty() && asks_for_all_known(earlier_seeds)) return earlier_seeds;
  if (asks_for_all_known({})) return {};
  std::vector<ImagePair> all;
  for (const VerifiedPair& known : verifier.KnownPairs()) all.push_back(known.pair);
  return all;
}

GraphMatchResult RunGraphMatch(const GraphMatchOptions& options, const Ranking& ranking,
                               const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                               ThreadPool& threads,
                               const std::function<void(const LoopProgress&)>& on_progress,
                               const std::vector<ImagePair>& seeds) {
  CheckInput(options, ranking, image_ids);
  Loop loop(options, ranking, image_ids, verifier, threads, on_progress);
  loop.Begin(seeds);
  return loop.Run(true);
}

GraphMatchResult RunGraphMatch(const GraphMatchOptions& options, const Ranking& ranking,
                               const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                               ThreadPool& threads,
                               const std::function<void(const LoopProgress&)>& on_progress) {
  return RunGraphMatch(options, ranking, image_ids, verifier, threads, on_progress,
                       ChooseSeeds(options, ranking, image_ids, verifier, threads, {}));
}

}  // namespace colmap_graphmatch
