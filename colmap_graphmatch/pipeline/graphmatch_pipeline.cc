#include <algorithm>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/timed.h"
#include "colmap_graphmatch/colmap_graphmatch.h"
#include "colmap_graphmatch/files/pair_log.h"
#include "colmap_graphmatch/graph/explorer.h"
#include "colmap_graphmatch/graph/seeds.h"
#include "colmap_graphmatch/pipeline/budgeted_verifier.h"
#include "colmap_graphmatch/pipeline/details_recorder.h"
#include "colmap_graphmatch/pipeline/run_setup.h"
#include "colmap_graphmatch/pipeline/run_verification.h"
#include "colmap_graphmatch/pipeline/strategy.h"

namespace colmap_graphmatch {
namespace {

// An image without an edge is explained by so many candidates.
constexpr std::size_t kMaxCandidatesInReport = 5;

std::vector<ImageId> Ids(const std::vector<ImageRecord>& images) {
  std::vector<ImageId> ids;
  ids.reserve(images.size());
  for (const ImageRecord& image : images) ids.push_back(image.id);
  return ids;
}

// Lists that are cut short by a budget are taken from their beginning.
BudgetedVerifier::Order OrderOfList(const std::vector<ImagePair>& listed) {
  auto places = std::make_shared<std::unordered_map<ImagePair, std::size_t>>();
  for (const ImagePair& pair : listed) places->emplace(pair, places->size());
  return [places](const ImagePair& pair) { return static_cast<double>(places->at(pair)); };
}

BudgetedVerifier::Order OrderOfRanking(const Ranking& ranking, const std::vector<ImageId>& ids) {
  return [&ranking, &ids](const ImagePair& pair) {
    const auto vertex = [&ids](ImageId id) {
      return static_cast<Vertex>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
    };
    return static_cast<double>(ranking.Distance(vertex(pair.id1), vertex(pair.id2)));
  };
}

PipelineResult::StoppedBy StoppedByOf(BudgetedVerifier::Limit reached) {
  switch (reached) {
    case BudgetedVerifier::Limit::kMaxPairs:
      return PipelineResult::StoppedBy::kMaxPairs;
    case BudgetedVerifier::Limit::kMaxMinutes:
      return PipelineResult::StoppedBy::kMaxMinutes;
    case BudgetedVerifier::Limit::kNone:
      break;
  }
  return PipelineResult::StoppedBy::kRequest;
}

// One run, step by step.
class Pipeline {
 public:
  Pipeline(const PipelineOptions& options, const StopRequest& stop, PipelineObserver& observer)
      : options_(options),
        observer_(observer),
        setup_(options.replay_path.empty() ? RunKind::kMatch : RunKind::kReplay, options, stop,
               observer),
        ranker_(setup_.MakeRanker()) {}

  PipelineResult Run() {
    Open();
    if (options_.RanksImages()) {
      const VectorModel model = ranker_.Learn(verification_->Verifier().KnownPairs());
      ranked_ = ranker_.Rank(ranker_.Encode(model));
    }
    Explore();
    return Conclude();
  }

 private:
  void Open();
  void Explore();
  PipelineResult Conclude();

  std::unique_ptr<PairProposer> NewProposer();
  // Which of the known pairs join the graph; what the loop starts from is kept for later runs.
  KnownPairsPolicy ChooseKnown();
  BudgetedVerifier::Order OrderOfTests() const;
  void OnProgress(const LoopProgress& progress);
  RunDetails Details();
  // Since the start of the run; of a replay, with the time that its tests would have taken.
  double Seconds() const;

  const PipelineOptions& options_;
  PipelineObserver& observer_;
  Stopwatch total_;
  RunSetup setup_;
  std::optional<PairLog> log_;
  std::unique_ptr<RunVerification> verification_;
  ImageRanker ranker_;
  RankedImages ranked_;            // Nothing, unless images are ranked.
  std::vector<ImageId> ids_;       // By vertex.
  PairRestrictions restrictions_;  // By vertex.
  ImagePriors priors_;             // By vertex; nothing, unless the strategy looks at them.
  DetailsRecorder recorder_;
  PipelineResult result_;
};

void Pipeline::Open() {
  if (!options_.pair_log_path.empty()) log_.emplace(options_.pair_log_path, setup_.all_images);
  setup_.ReadLists();
  verification_ = MakeRunVerification(setup_);
}

void Pipeline::Explore() {
  const std::vector<ImageRecord>& images = options_.RanksImages() ? ranked_.images : setup_.images;
  ids_ = Ids(images);
  restrictions_ = setup_.RestrictionsOf(images);
  if (options_.RanksImages() && options_.strategy == PipelineOptions::Strategy::kBestFirst) {
    priors_ = setup_.PriorsOf(images);
  }
  BudgetedVerifier budgeted(
      verification_->Verifier(), options_.budget, setup_.threads.NumThreads(),
      [this] { return Seconds(); }, OrderOfTests());
  result_.matching = Timed(&result_.matching_seconds, [&] {
    const std::unique_ptr<PairProposer> proposer = NewProposer();
    return colmap_graphmatch::Explore(
        *proposer, ids_, budgeted, [this](const LoopProgress& progress) { OnProgress(progress); },
        ChooseKnown());
  });
  if (!result_.matching.finished) result_.stopped_by = StoppedByOf(budgeted.Reached());
}

PipelineResult Pipeline::Conclude() {
  if (options_.keep_details) result_.details = Details();
  result_.cost = verification_->Cost();
  verification_->Finish();
  // Its end counts as part of the run: the work directory and the descriptor cache go before the
  // log is closed and the time is taken.
  verification_.reset();
  if (log_) log_->Close();
  result_.num_images = setup_.all_images.size();
  result_.num_images_without_features = setup_.all_images.size() - setup_.images.size();
  result_.num_threads = setup_.threads.NumThreads();
  result_.preprocessing_seconds = ranker_.Seconds();
  result_.total_seconds = total_.Seconds();
  return std::move(result_);
}

std::unique_ptr<PairProposer> Pipeline::NewProposer() {
  return MakeProposer(options_, {ids_, restrictions_, setup_.listed_pairs, ranked_.ranking.get(),
                                 priors_, setup_.threads});
}

KnownPairsPolicy Pipeline::ChooseKnown() {
  KnownPairsPolicy known;
  // A replay knows no pair beforehand, and its checkpoint keeps nothing.
  if (setup_.kind == RunKind::kReplay) return known;
  if (!options_.RanksImages() || !StartsFromSeeds(options_.strategy)) return known;
  const std::string key = LoopKey(options_, restrictions_);
  known.seeds = ChooseSeeds([this] { return NewProposer(); }, ids_, verification_->Verifier(),
                            setup_.checkpoint.ReadSeeds(key), setup_.stop);
  setup_.checkpoint.KeepSeeds(key, known.seeds);
  return known;
}

BudgetedVerifier::Order Pipeline::OrderOfTests() const {
  if (options_.RanksImages()) return OrderOfRanking(*ranked_.ranking, ids_);
  if (setup_.listed_pairs.empty() || options_.budget.IsUnlimited()) return {};
  return OrderOfList(setup_.listed_pairs);
}

void Pipeline::OnProgress(const LoopProgress& progress) {
  result_.num_expected_tests_left = progress.expected_remaining_tests;
  if (log_) log_->Write(progress, Seconds());
  if (options_.keep_details) recorder_.Add(progress, Seconds());
  observer_.OnProgress(progress);
}

RunDetails Pipeline::Details() {
  recorder_.AddKnown(verification_->Verifier().KnownPairs(), setup_.images);
  RunDetails details;
  details.images = setup_.all_images;
  details.discovery = recorder_.Discovery();
  details.tested = recorder_.Tested();
  details.images_without_edge = FindImagesWithoutEdge(
      details.images, details.tested, ranked_.ranking.get(),
      options_.RanksImages() ? ids_ : std::vector<ImageId>(), kMaxCandidatesInReport);
  return details;
}

double Pipeline::Seconds() const {
  const std::optional<double> modelled = verification_->ModelledSeconds();
  return modelled ? ranker_.Seconds().Sum() + *modelled : total_.Seconds();
}

}  // namespace

PipelineResult RunPipeline(const PipelineOptions& options, const StopRequest& stop,
                           PipelineObserver& observer) {
  options.Check();
  return Pipeline(options, stop, observer).Run();
}

}  // namespace colmap_graphmatch
