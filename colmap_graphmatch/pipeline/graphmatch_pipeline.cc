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

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/graph/listed_pairs.h"
#include "colmap_graphmatch/matching/top_two.h"
#include "colmap_graphmatch/pipeline/finished_graph.h"
#include "colmap_graphmatch/pipeline/image_ranking.h"
#include "colmap_graphmatch/pipeline/pair_list.h"
#include "colmap_graphmatch/pipeline/run_state.h"
#include "colmap_graphmatch/pipeline/test_log.h"
#include "colmap_graphmatch/pipeline/timed.h"
#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/work_directory.h"

namespace colmap_graphmatch {
namespace {

std::vector<ImageId> Ids(const std::vector<ImageRecord>& images) {
  std::vector<ImageId> ids;
  ids.reserve(images.size());
  for (const ImageRecord& image : images) ids.push_back(image.id);
  return ids;
}

// What the seeds of a loop depend on, apart from the images and their vectors.
std::string LoopKey(const PipelineOptions& options, const GraphMatchOptions& graph) {
  return "loop: " + graph.Key() + ", inliers " +
         std::to_string(options.verification.min_num_inliers);
}

bool RetrievesOnce(PipelineOptions::Strategy strategy) {
  return strategy == PipelineOptions::Strategy::kRetrieval ||
         strategy == PipelineOptions::Strategy::kBriad;
}

RetrievalOptions MakeRetrievalOptions(const PipelineOptions& options) {
  const bool expands = options.strategy == PipelineOptions::Strategy::kBriad;
  RetrievalOptions retrieval;
  retrieval.num_images = options.num_retrieved_images > 0 ? options.num_retrieved_images
                         : expands                        ? 40
                                                          : 120;
  retrieval.num_expansions = expands ? options.num_expansions : 0;
  return retrieval;
}

GraphMatchOptions MakeGraphOptions(const PipelineOptions& options) {
  GraphMatchOptions graph = options.graph;
  if (options.strategy == PipelineOptions::Strategy::kSampling) graph.num_to_propagate = 0;
  if (options.strategy == PipelineOptions::Strategy::kPropagation) {
    graph.number_sample_iterations = std::min(graph.number_sample_iterations, 1);
  }
  return graph;
}

std::vector<ImagePair> ReadListedPairs(const std::filesystem::path& path,
                                       const std::vector<ImageRecord>& images,
                                       const StopRequest& stop, PipelineObserver& observer) {
  PairList list = ReadPairList(path, images, &stop);
  WarnOfSkippedLines(list, path, "two different images", observer);
  return std::move(list.pairs);
}

}  // namespace

void PipelineOptions::Check() const {
  if (!match_list_path.empty() && strategy != Strategy::kGraphMatch) {
    throw OptionsError(
        "--GraphMatching.match_list_path and --GraphMatching.strategy contradict each other: give "
        "one of them.");
  }
  if (!match_list_path.empty() && !image_list_path.empty()) {
    throw OptionsError(
        "--GraphMatching.match_list_path lists pairs, --VocabTreeMatching.match_list_path images "
        "that look for partners: give one of them.");
  }
  const bool ranks = match_list_path.empty() && strategy != Strategy::kExhaustive;
  if (!ranks && (!ranking.ranking_path.empty() || !ranking.export_path.empty() ||
                 !ranking.vectors.vectors_path.empty())) {
    throw OptionsError(
        "--GraphMatching.ranking_path, --GraphMatching.vectors_path and "
        "--GraphMatching.export_vectors need a strategy that ranks images; a list of pairs and the "
        "strategy exhaustive do not.");
  }
  EffectiveNumThreads(num_threads);
  if (num_retrieved_images < 0) {
    throw OptionsError("num_retrieved_images is " + std::to_string(num_retrieved_images) +
                       "; it must be positive, or 0 to have it chosen.");
  }
  if (dry_run && (!ranks || !replay_path.empty())) {
    throw OptionsError(
        "--GraphMatching.dry_run shows which pairs a strategy that ranks images would test first; "
        "with a list of pairs, the strategy exhaustive or --GraphMatching.replay_path there is "
        "nothing to show.");
  }
  MakeRetrievalOptions(*this).Check();
  budget.Check();
  ranking.Check();
  graph.Check();
  verification.Check();
}

namespace {

// What is known of the job before it is known how pairs are verified.
struct Job {
  const PipelineOptions& options;
  const StopRequest& stop;
  PipelineObserver& observer;
  ThreadPool& threads;
  Database& database;
  RunState& state;
  const std::vector<ImageRecord>& all_images;
  const std::vector<ImageRecord>& images;             // Those with features,
  const std::vector<ImageFingerprint>& fingerprints;  // and of which.
  std::vector<ImagePair> listed_pairs;                // Of match_list_path.
  std::vector<ImageId> seeking;                       // Of image_list_path.
  std::function<double()> seconds;                    // Since the start of the run.
};

using OnProgress = std::function<void(const LoopProgress&)>;

// An image without an edge is explained by so many candidates.
constexpr std::size_t kMaxCandidatesInReport = 5;

PairRestrictions FindRestrictions(const Job& job, const std::vector<ImageRecord>& images) {
  PairRestrictions restrictions;
  if (!job.seeking.empty()) {
    for (const ImageRecord& image : images) {
      restrictions.seeking.push_back(
          std::binary_search(job.seeking.begin(), job.seeking.end(), image.id));
    }
  }
  if (job.options.skip_image_pairs_in_same_frame) {
    const std::map<ImageId, std::uint32_t> frames = job.database.ReadFrames();
    for (const ImageRecord& image : images) {
      const auto frame = frames.find(image.id);
      restrictions.frames.push_back(frame == frames.end() ? 0 : frame->second);
    }
  }
  return restrictions;
}

RankedImages Rank(const Job& job, const std::vector<VerifiedPair>& known, PipelineResult* result) {
  ImageRankingOptions options = job.options.ranking;
  options.vectors.seed = job.options.seed;
  options.vectors.gmm.seed = job.options.seed;
  return RankImages(options, job.database, job.images, job.fingerprints, known, job.state,
                    job.threads, job.stop, job.observer, &result->preprocessing_seconds);
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

// Tests pairs with test(verifier) as long as the budget lasts.
template <typename Test>
GraphMatchResult TestWithinBudget(const Job& job, PairVerifier& verifier,
                                  const BudgetedVerifier::Order& order, PipelineResult* result,
                                  const Test& test) {
  BudgetedVerifier budgeted(verifier, job.options.budget, job.threads.NumThreads(), job.seconds,
                            order);
  GraphMatchResult matching =
      Timed(&result->matching_seconds, [&]() -> GraphMatchResult { return test(budgeted); });
  if (!matching.finished) {
    using Limit = BudgetedVerifier::Limit;
    using StoppedBy = PipelineResult::StoppedBy;
    result->stopped_by = budgeted.Reached() == Limit::kMaxPairs     ? StoppedBy::kMaxPairs
                         : budgeted.Reached() == Limit::kMaxMinutes ? StoppedBy::kMaxMinutes
                                                                    : StoppedBy::kRequest;
  }
  return matching;
}

void KeepDetails(const Job& job, const PairVerifier& verifier, const Ranking* ranking,
                 const std::vector<ImageId>& ids, RunRecord* record, PipelineResult* result) {
  if (!job.options.keep_details) return;
  record->AddKnown(verifier.KnownPairs(), job.images);
  result->discovery = record->Discovery();
  result->tested = record->Tested();
  result->images = job.all_images;
  result->images_without_edge =
      FindImagesWithoutEdge(job.all_images, result->tested, ranking, ids, kMaxCandidatesInReport);
}

// Tests the pairs that the strategy asks for.
GraphMatchResult FindEdges(const Job& job, PairVerifier& verifier, const OnProgress& on_progress,
                           RunRecord* record, PipelineResult* result) {
  const PipelineOptions& options = job.options;
  if (result->listed) {
    const PairRestrictions restrictions = FindRestrictions(job, job.images);
    const std::vector<ImageId> ids = Ids(job.images);
    const bool all = options.match_list_path.empty();
    const BudgetedVerifier::Order order = all || options.budget.IsUnlimited()
                                              ? BudgetedVerifier::Order()
                                              : OrderOfList(job.listed_pairs);
    GraphMatchResult matching =
        TestWithinBudget(job, verifier, order, result, [&](PairVerifier& budgeted) {
          return all ? VerifyAllPairs(ids, budgeted, on_progress, restrictions)
                     : VerifyListedPairs(job.listed_pairs, ids, budgeted, on_progress,
                                         restrictions);
        });
    KeepDetails(job, verifier, nullptr, {}, record, result);
    return matching;
  }

  const RankedImages ranked = Rank(job, verifier.KnownPairs(), result);
  const Ranking& ranking = *ranked.ranking;
  const std::vector<ImageId> ids = Ids(ranked.images);
  const PairRestrictions restrictions = FindRestrictions(job, ranked.images);
  const auto test = [&](PairVerifier& budgeted) {
    if (RetrievesOnce(options.strategy)) {
      RetrievalOptions retrieval = MakeRetrievalOptions(options);
      retrieval.restrictions = restrictions;
      return RunRetrieval(retrieval, ranking, ids, budgeted, job.threads, on_progress);
    }
    GraphMatchOptions graph = MakeGraphOptions(options);
    graph.restrictions = restrictions;
    if (result->replayed) {
      return RunGraphMatch(graph, ranking, ids, budgeted, job.threads, on_progress);
    }
    const std::string key = LoopKey(options, graph);
    const std::vector<ImagePair> seeds =
        ChooseSeeds(graph, ranking, ids, verifier, job.threads, job.state.ReadSeeds(key));
    job.state.KeepSeeds(key, seeds);
    return RunGraphMatch(graph, ranking, ids, budgeted, job.threads, on_progress, seeds);
  };
  GraphMatchResult matching =
      TestWithinBudget(job, verifier, OrderOfRanking(ranking, ids), result, test);
  KeepDetails(job, verifier, &ranking, ids, record, result);
  return matching;
}

// Fills the candidates of a dry run.
void FindCandidates(const Job& job, PipelineResult* result) {
  const PipelineOptions& options = job.options;
  const std::vector<VerifiedPair> known = job.database.ReadVerifiedPairs(
      static_cast<std::size_t>(options.verification.min_num_inliers));
  const RankedImages ranked = Rank(job, known, result);
  RetrievalOptions retrieval = MakeRetrievalOptions(options);
  if (!RetrievesOnce(options.strategy)) {
    retrieval.num_images = MakeGraphOptions(options).MaxTestsForSampling(ranked.images.size());
  }
  retrieval.restrictions = FindRestrictions(job, ranked.images);
  for (const VertexPair& pair : RetrievePairs(retrieval, *ranked.ranking, job.threads)) {
    const ImagePair images(ranked.images[pair.first].id, ranked.images[pair.second].id);
    if (FindPair(known, images) != nullptr) continue;
    result->candidates.push_back({images, ranked.ranking->Distance(pair.first, pair.second)});
  }
  std::sort(result->candidates.begin(), result->candidates.end(),
            [](const CandidatePair& a, const CandidatePair& b) {
              return std::tie(a.distance, a.pair) < std::tie(b.distance, b.pair);
            });
  result->num_candidates_per_image = static_cast<std::size_t>(retrieval.num_images);
  result->images = job.all_images;
}

void MatchWithColmap(const Job& job, const OnProgress& on_progress, RunRecord* record,
                     PipelineResult* result) {
  const PipelineOptions& options = job.options;
  const auto warn = [&](const std::string& warning) { job.observer.OnWarning(warning); };
  const WorkDirectory work(options.work_path, WorkDirectory::Guard::kGuarded);
  const ColmapInstallation colmap = DetectColmap(options.colmap_path, work.Path(), job.stop);
  VerificationOptions verification = options.verification;
  verification.num_threads = options.num_threads;
  const VerificationPlan plan = PlanVerification(verification, colmap);
  ColmapVerifier geometry(verification, colmap, job.database.Path(), job.images, work.Path(),
                          job.stop, warn);
  BatchVerifier verifier(verification, plan, geometry, job.database, job.images, job.stop, warn);
  job.observer.OnInfo(
      std::string("Descriptors are matched ") +
      (plan.matches_here ? std::string("exactly, with ") + TopTwoTarget() + "." : "by COLMAP."));
  job.observer.OnInfo("COLMAP " + colmap.Version() + " at " + colmap.executable.string() + ", " +
                      (plan.uses_gpu ? "GPU" : "CPU") +
                      ", processes: " + std::to_string(plan.num_processes) +
                      ", threads in each: " + std::to_string(plan.threads_per_process) + ".");
  result->matching = FindEdges(job, verifier, on_progress, record, result);
  result->descriptor_matching = verifier.Statistics();
  result->colmap = geometry.SoFar();
}

// Makes the verifier that answers from the finished graph.
ReplayVerifier MakeReplayVerifier(const Job& job) {
  const PipelineOptions& options = job.options;
  FinishedGraph graph =
      ReadFinishedGraph(options.replay_path, job.images, options.verification.min_num_inliers,
                        {options.verification.lock_timeout, &job.stop});
  WarnOfSkippedLines(graph, options.replay_path, "two different images", job.observer);
  job.observer.OnInfo("Replays the matching graph of " + options.replay_path.string() + ", with " +
                      std::to_string(graph.num_edges) +
                      " edges: nothing is matched, and nothing is written to the database.");
  ReplayVerifier verifier(std::move(graph.pairs));
  std::unordered_map<ImageId, std::size_t> num_features;
  for (const ImageRecord& image : job.images) num_features[image.id] = image.num_features;
  verifier.SetStop(&job.stop);
  verifier.SetCosts(std::move(num_features), job.threads.NumThreads());
  return verifier;
}

}  // namespace

PipelineResult RunPipeline(const PipelineOptions& options, const StopRequest& stop,
                           PipelineObserver& observer) {
  options.Check();
  const Stopwatch total;
  PipelineResult result;
  result.replayed = !options.replay_path.empty();
  result.listed = !options.match_list_path.empty() ||
                  options.strategy == PipelineOptions::Strategy::kExhaustive;
  ThreadPool threads(options.num_threads);
  result.num_threads = threads.NumThreads();
  const int num_wanted = EffectiveNumThreads(options.num_threads);
  if (threads.NumThreads() < num_wanted) {
    observer.OnWarning("The system lets this program start fewer threads than the " +
                       std::to_string(num_wanted) +
                       " that are wanted (ulimit -u, or a limit of the container): it works with "
                       "what it gets, and is slower.");
  }

  const bool reads_only = result.replayed || options.dry_run;
  const sqlite::LockPatience patience(options.verification.lock_timeout, &stop);
  Database database(options.database_path,
                    reads_only ? sqlite::Access::kRead : sqlite::Access::kReadWrite, patience);
  const std::vector<ImageRecord> all_images = database.ReadImages();
  if (!reads_only) database.CheckWritable();
  const auto info = [&](const std::string& message) { observer.OnInfo(message); };
  const auto warn = [&](const std::string& warning) { observer.OnWarning(warning); };
  // Nothing of a replay is for the next run on these photos.
  RunState state =
      result.replayed ? RunState() : RunState(options.database_path, patience, info, warn);
  const std::vector<ImageRecord> images = WithFeatures(all_images);
  const std::vector<ImageFingerprint> fingerprints = database.ReadFingerprints(images);
  database.ExpectFeatures(images, fingerprints);
  result.num_images = all_images.size();
  result.num_images_without_features = all_images.size() - images.size();
  if (images.size() < all_images.size()) {
    observer.OnWarning(std::to_string(result.num_images_without_features) + " of " +
                       std::to_string(all_images.size()) +
                       " images have no features and cannot be matched.");
  }
  if (images.size() == 1) {
    observer.OnWarning("Only one image has features: there is no pair to test.");
  }

  std::optional<TestLog> log;
  if (!options.test_log_path.empty()) log.emplace(options.test_log_path, all_images);
  Job job = {options,      stop,  observer,   threads,
             database,     state, all_images, images,
             fingerprints, {},    {},         [&total] { return total.Seconds(); }};
  if (!options.match_list_path.empty()) {
    job.listed_pairs = ReadListedPairs(options.match_list_path, all_images, stop, observer);
  }
  if (!options.image_list_path.empty()) {
    ImageList list = ReadImageList(options.image_list_path, images, &stop);
    WarnOfSkippedLines(list, options.image_list_path, "an image", observer);
    job.seeking = std::move(list.images);
  }
  if (options.dry_run) {
    FindCandidates(job, &result);
    result.dry_run = true;
    result.total_seconds = total.Seconds();
    return result;
  }
  RunRecord record;
  const auto on_progress = [&](const LoopProgress& progress) {
    result.num_expected_tests_left = progress.expected_remaining_tests;
    if (log) log->Write(progress, job.seconds());
    if (options.keep_details) record.Add(progress, job.seconds());
    observer.OnProgress(progress);
  };
  if (result.replayed) {
    ReplayVerifier verifier = MakeReplayVerifier(job);
    job.seconds = [&] { return result.preprocessing_seconds.Sum() + verifier.ModelledSeconds(); };
    result.matching = FindEdges(job, verifier, on_progress, &record, &result);
    result.modelled_seconds = verifier.ModelledSeconds();
  } else {
    MatchWithColmap(job, on_progress, &record, &result);
    database.CheckInPlace();
  }
  if (log) log->Close();
  result.total_seconds = total.Seconds();
  return result;
}

}  // namespace colmap_graphmatch
