#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/graph/graphmatch.h"
#include "colmap_graphmatch/graph/listed_pairs.h"
#include "colmap_graphmatch/matching/top_two.h"
#include "colmap_graphmatch/pipeline/finished_graph.h"
#include "colmap_graphmatch/pipeline/image_ranking.h"
#include "colmap_graphmatch/pipeline/pair_list.h"
#include "colmap_graphmatch/pipeline/run_state.h"
#include "colmap_graphmatch/pipeline/strategy.h"
#include "colmap_graphmatch/pipeline/test_log.h"
#include "colmap_graphmatch/pipeline/timed.h"
#include "colmap_graphmatch/verification/chosen_verifier.h"
#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/work_directory.h"

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

// One run, step by step.
class Pipeline {
 public:
  Pipeline(const PipelineOptions& options, const StopRequest& stop, PipelineObserver& observer)
      : options_(options), stop_(stop), observer_(observer), threads_(options.num_threads) {
    result_.replayed = !options.replay_path.empty();
    result_.listed = !options.match_list_path.empty() ||
                     options.strategy == PipelineOptions::Strategy::kExhaustive;
    result_.dry_run = options.dry_run;
    result_.num_threads = threads_.NumThreads();
  }

  PipelineResult Run() {
    WarnOfFewThreads();
    OpenDatabase();
    ReadLists();
    if (options_.dry_run) {
      FindCandidates();
    } else if (result_.replayed) {
      Replay();
    } else {
      MatchAndVerify();
    }
    if (log_) log_->Close();
    result_.total_seconds = total_.Seconds();
    return std::move(result_);
  }

 private:
  void WarnOfFewThreads();
  void OpenDatabase();
  void ReadLists();
  void FindCandidates();
  void Replay();
  void MatchAndVerify();

  // Learns, encodes and ranks.
  void Rank(const std::vector<VerifiedPair>& known);
  // Has tested what the strategy proposes.
  void ExploreWith(PairVerifier& verifier);

  PairRestrictions FindRestrictions(const std::vector<ImageRecord>& images);
  std::unique_ptr<PairProposer> MakeProposer(const std::vector<ImageId>& ids,
                                             const PairRestrictions& restrictions);
  KnownPairsPolicy ChooseKnown(const std::vector<ImageId>& ids,
                               const PairRestrictions& restrictions, PairVerifier& verifier);
  BudgetedVerifier::Order OrderOfTests(const std::vector<ImageId>& ids) const;
  void OnProgress(const LoopProgress& progress);
  void KeepDetails(const PairVerifier& verifier, const std::vector<ImageId>& ids);

  const PipelineOptions& options_;
  const StopRequest& stop_;
  PipelineObserver& observer_;
  Stopwatch total_;
  ThreadPool threads_;
  PipelineResult result_;

  std::optional<Database> database_;
  RunState state_;
  std::vector<ImageRecord> all_images_;
  std::vector<ImageRecord> images_;             // Those with features,
  std::vector<ImageFingerprint> fingerprints_;  // and of which.
  std::vector<ImagePair> listed_pairs_;         // Of match_list_path.
  std::vector<ImageId> seeking_;                // Of image_list_path.
  RankedImages ranked_;                         // Nothing, if pairs are listed.

  std::function<double()> seconds_ = [this] { return total_.Seconds(); };  // Since the start.
  RunRecord record_;
  std::optional<TestLog> log_;
};

void Pipeline::WarnOfFewThreads() {
  const int num_wanted = EffectiveNumThreads(options_.num_threads);
  if (threads_.NumThreads() >= num_wanted) return;
  observer_.OnWarning("The system lets this program start fewer threads than the " +
                      std::to_string(num_wanted) +
                      " that are wanted (ulimit -u, or a limit of the container): it works with "
                      "what it gets, and is slower.");
}

void Pipeline::OpenDatabase() {
  const bool reads_only = result_.replayed || options_.dry_run;
  const sqlite::LockPatience patience(options_.verification.lock_timeout, &stop_);
  database_.emplace(options_.database_path,
                    reads_only ? sqlite::Access::kRead : sqlite::Access::kReadWrite, patience);
  all_images_ = database_->ReadImages();
  if (!reads_only) database_->CheckWritable();
  // Nothing of a replay is for the next run on these photos.
  if (!result_.replayed) {
    state_ = RunState(
        options_.database_path, patience,
        [this](const std::string& message) { observer_.OnInfo(message); },
        [this](const std::string& warning) { observer_.OnWarning(warning); });
  }
  images_ = WithFeatures(all_images_);
  fingerprints_ = database_->ReadFingerprints(images_);
  database_->ExpectFeatures(images_, fingerprints_);
  result_.num_images = all_images_.size();
  result_.num_images_without_features = all_images_.size() - images_.size();
  if (images_.size() < all_images_.size()) {
    observer_.OnWarning(std::to_string(result_.num_images_without_features) + " of " +
                        std::to_string(all_images_.size()) +
                        " images have no features and cannot be matched.");
  }
  if (images_.size() == 1) {
    observer_.OnWarning("Only one image has features: there is no pair to test.");
  }
}

void Pipeline::ReadLists() {
  if (!options_.test_log_path.empty()) log_.emplace(options_.test_log_path, all_images_);
  if (!options_.match_list_path.empty()) {
    PairList list = ReadPairList(options_.match_list_path, all_images_, &stop_);
    WarnOfSkippedLines(list, options_.match_list_path, "two different images", observer_);
    listed_pairs_ = std::move(list.pairs);
  }
  if (!options_.image_list_path.empty()) {
    ImageList list = ReadImageList(options_.image_list_path, images_, &stop_);
    WarnOfSkippedLines(list, options_.image_list_path, "an image", observer_);
    seeking_ = std::move(list.images);
  }
}

void Pipeline::Rank(const std::vector<VerifiedPair>& known) {
  ImageRankingOptions options = options_.ranking;
  options.vectors.seed = options_.seed;
  options.vectors.gmm.seed = options_.seed;
  ranked_ = RankImages(options, *database_, images_, fingerprints_, known, state_, threads_, stop_,
                       observer_, &result_.preprocessing_seconds);
}

PairRestrictions Pipeline::FindRestrictions(const std::vector<ImageRecord>& images) {
  PairRestrictions restrictions;
  if (!seeking_.empty()) {
    for (const ImageRecord& image : images) {
      restrictions.seeking.push_back(
          std::binary_search(seeking_.begin(), seeking_.end(), image.id));
    }
  }
  if (options_.skip_image_pairs_in_same_frame) {
    const std::map<ImageId, std::uint32_t> frames = database_->ReadFrames();
    for (const ImageRecord& image : images) {
      const auto frame = frames.find(image.id);
      restrictions.frames.push_back(frame == frames.end() ? 0 : frame->second);
    }
  }
  return restrictions;
}

std::unique_ptr<PairProposer> Pipeline::MakeProposer(const std::vector<ImageId>& ids,
                                                     const PairRestrictions& restrictions) {
  if (!options_.match_list_path.empty()) {
    return std::make_unique<ListedPairsProposer>(listed_pairs_, ids, restrictions);
  }
  if (result_.listed) return std::make_unique<AllPairsProposer>(restrictions);
  return MakeRankingProposer(options_, restrictions, *ranked_.ranking, threads_);
}

KnownPairsPolicy Pipeline::ChooseKnown(const std::vector<ImageId>& ids,
                                       const PairRestrictions& restrictions,
                                       PairVerifier& verifier) {
  KnownPairsPolicy known;
  if (result_.listed || result_.replayed || !IsLoop(options_.strategy)) return known;
  GraphMatchOptions graph = LoopOptionsOf(options_);
  graph.restrictions = restrictions;
  const std::string key = LoopKey(options_, restrictions);
  known.seeds =
      ChooseSeeds(graph, *ranked_.ranking, ids, verifier, threads_, state_.ReadSeeds(key));
  state_.KeepSeeds(key, known.seeds);
  return known;
}

BudgetedVerifier::Order Pipeline::OrderOfTests(const std::vector<ImageId>& ids) const {
  if (!result_.listed) return OrderOfRanking(*ranked_.ranking, ids);
  if (listed_pairs_.empty() || options_.budget.IsUnlimited()) return {};
  return OrderOfList(listed_pairs_);
}

void Pipeline::ExploreWith(PairVerifier& verifier) {
  if (!result_.listed) Rank(verifier.KnownPairs());
  const std::vector<ImageRecord>& images = result_.listed ? images_ : ranked_.images;
  const std::vector<ImageId> ids = Ids(images);
  const PairRestrictions restrictions = FindRestrictions(images);
  BudgetedVerifier budgeted(verifier, options_.budget, threads_.NumThreads(), seconds_,
                            OrderOfTests(ids));
  result_.matching = Timed(&result_.matching_seconds, [&] {
    const std::unique_ptr<PairProposer> proposer = MakeProposer(ids, restrictions);
    const KnownPairsPolicy known = ChooseKnown(ids, restrictions, verifier);
    return Explore(
        *proposer, ids, budgeted, [this](const LoopProgress& progress) { OnProgress(progress); },
        known);
  });
  if (!result_.matching.finished) {
    using Limit = BudgetedVerifier::Limit;
    using StoppedBy = PipelineResult::StoppedBy;
    result_.stopped_by = budgeted.Reached() == Limit::kMaxPairs     ? StoppedBy::kMaxPairs
                         : budgeted.Reached() == Limit::kMaxMinutes ? StoppedBy::kMaxMinutes
                                                                    : StoppedBy::kRequest;
  }
  KeepDetails(verifier, ids);
}

void Pipeline::OnProgress(const LoopProgress& progress) {
  result_.num_expected_tests_left = progress.expected_remaining_tests;
  if (log_) log_->Write(progress, seconds_());
  if (options_.keep_details) record_.Add(progress, seconds_());
  observer_.OnProgress(progress);
}

void Pipeline::KeepDetails(const PairVerifier& verifier, const std::vector<ImageId>& ids) {
  if (!options_.keep_details) return;
  record_.AddKnown(verifier.KnownPairs(), images_);
  result_.discovery = record_.Discovery();
  result_.tested = record_.Tested();
  result_.images = all_images_;
  result_.images_without_edge =
      FindImagesWithoutEdge(all_images_, result_.tested, ranked_.ranking.get(),
                            result_.listed ? std::vector<ImageId>() : ids, kMaxCandidatesInReport);
}

void Pipeline::MatchAndVerify() {
  const auto warn = [this](const std::string& warning) { observer_.OnWarning(warning); };
  const WorkDirectory work(options_.work_path, WorkDirectory::Guard::kGuarded);
  VerificationOptions verification = options_.verification;
  verification.num_threads = options_.num_threads;
  std::optional<ColmapInstallation> colmap;
  if (verification.verifier != VerificationOptions::Verifier::kNative) {
    colmap = DetectColmap(options_.colmap_path, work.Path(), stop_);
  }
  const VerificationPlan plan =
      PlanVerification(verification, colmap.value_or(ColmapInstallation()));
  ChosenVerifier geometry(verification, plan, colmap, *database_, images_, work.Path(), stop_,
                          warn);
  BatchVerifier verifier(verification, plan, geometry.Get(), *database_, images_, stop_, warn);
  observer_.OnInfo(
      std::string("Descriptors are matched ") +
      (plan.matches_here ? std::string("exactly, with ") + TopTwoTarget() + "." : "by COLMAP."));
  if (colmap) {
    observer_.OnInfo("COLMAP " + colmap->Version() + " at " + colmap->executable.string() + ", " +
                     (plan.uses_gpu ? "GPU" : "CPU") +
                     ", processes: " + std::to_string(plan.num_processes) +
                     ", threads in each: " + std::to_string(plan.threads_per_process) + ".");
  }
  using Verifier = VerificationOptions::Verifier;
  observer_.OnInfo(plan.verifier == Verifier::kNative ? "Pairs are verified by this program."
                   : plan.verifier == Verifier::kScreened
                       ? "Pairs are verified by COLMAP, after a fast fit."
                       : "Pairs are verified by COLMAP.");
  ExploreWith(verifier);
  result_.descriptor_matching = verifier.Statistics();
  result_.colmap = geometry.Colmap();
  result_.fits = geometry.Fits();
  database_->CheckInPlace();
}

void Pipeline::Replay() {
  FinishedGraph graph = ReadFinishedGraph(options_.replay_path, images_,
                                          options_.verification.geometry.min_num_inliers,
                                          {options_.verification.lock_timeout, &stop_});
  WarnOfSkippedLines(graph, options_.replay_path, "two different images", observer_);
  observer_.OnInfo("Replays the matching graph of " + options_.replay_path.string() + ", with " +
                   std::to_string(graph.num_edges) +
                   " edges: nothing is matched, and nothing is written to the database.");
  ReplayVerifier verifier(std::move(graph.pairs));
  std::unordered_map<ImageId, std::size_t> num_features;
  for (const ImageRecord& image : images_) num_features[image.id] = image.num_features;
  verifier.SetInliers(std::move(graph.read_inliers));
  verifier.SetStop(&stop_);
  verifier.SetCosts(std::move(num_features), threads_.NumThreads());
  seconds_ = [this, &verifier] {
    return result_.preprocessing_seconds.Sum() + verifier.ModelledSeconds();
  };
  ExploreWith(verifier);
  result_.modelled_seconds = verifier.ModelledSeconds();
}

void Pipeline::FindCandidates() {
  const std::vector<VerifiedPair> known = database_->ReadVerifiedPairs(
      static_cast<std::size_t>(options_.verification.geometry.min_num_inliers));
  Rank(known);
  const std::vector<ImageRecord>& images = ranked_.images;
  RetrievalOptions retrieval = RetrievalOptionsOf(options_);
  if (IsLoop(options_.strategy)) {
    retrieval.num_images = LoopOptionsOf(options_).MaxTestsForSampling(images.size());
  }
  retrieval.restrictions = FindRestrictions(images);
  for (const VertexPair& pair : RetrievePairs(retrieval, *ranked_.ranking, threads_)) {
    const ImagePair candidate(images[pair.first].id, images[pair.second].id);
    if (FindPair(known, candidate) != nullptr) continue;
    result_.candidates.push_back({candidate, ranked_.ranking->Distance(pair.first, pair.second)});
  }
  std::sort(result_.candidates.begin(), result_.candidates.end(),
            [](const CandidatePair& a, const CandidatePair& b) {
              return std::tie(a.distance, a.pair) < std::tie(b.distance, b.pair);
            });
  result_.num_candidates_per_image = static_cast<std::size_t>(retrieval.num_images);
  result_.images = all_images_;
}

}  // namespace

PipelineResult RunPipeline(const PipelineOptions& options, const StopRequest& stop,
                           PipelineObserver& observer) {
  options.Check();
  return Pipeline(options, stop, observer).Run();
}

}  // namespace colmap_graphmatch
