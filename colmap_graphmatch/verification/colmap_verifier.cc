#include "colmap_graphmatch/verification/colmap_verifier.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <exception>
#include <fstream>
#include <iterator>
#include <mutex>
#include <unordered_set>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/matching/pair_order.h"
#include "colmap_graphmatch/verification/subprocess.h"
#include "colmap_graphmatch/verification/work_directory.h"

namespace colmap_graphmatch {
namespace {

// A batch is cut into about this many shards, so that up to as many processes have something to do.
// Fixed: what a shard contains must not depend on the number of cores.
constexpr std::size_t kShardsPerBatch = 64;

// Below this the start of COLMAP and the copy of the features would cost more than a few per cent.
constexpr std::size_t kMinPairsPerShard = 8;

// How many times as many pairs are matched here at a time as COLMAP gets at most: where pairs are
// rare that have enough matches, COLMAP would otherwise be started for one or two of them.
constexpr std::size_t kPairsMatchedPerVerified = 4;

// Runs of COLMAP on the same pairs before they are split or given up: a second try gets past what
// was not their fault (memory, a signal).
constexpr int kTries = 2;

// Pairs in a row, no two of them with an image in common and no other pair verified between them,
// on which COLMAP has to fail to be given up. One bad image fails in many pairs, and they come
// together.
constexpr std::size_t kMaxUnrelatedFailures = 4;

// How much slower than the slowest shard so far a shard may be, and the seconds that any may take.
constexpr double kPatience = 20;
constexpr double kMinTimeoutSeconds = 30;

// What COLMAP 3.13 and later match with; not for others to leave out silently.
constexpr char kMatcherType[] = "FeatureMatching.type";

// The first COLMAP that is known to store pairs with too few matches as degenerate instead of
// undefined.
constexpr std::pair<int, int> kFirstDegenerate(4, 2);

// Pairs that share images come into the same shard, and shards that do follow each other.
std::vector<std::vector<ImagePair>> CutIntoShards(std::vector<ImagePair> pairs,
                                                  std::size_t min_pairs_per_shard,
                                                  std::size_t max_pairs_per_shard) {
  SortForReuse(&pairs);
  const std::size_t wanted = (pairs.size() + kShardsPerBatch - 1) / kShardsPerBatch;
  const std::size_t size = std::min(std::max(wanted, min_pairs_per_shard), max_pairs_per_shard);
  std::vector<std::vector<ImagePair>> shards;
  for (std::size_t first = 0; first < pairs.size(); first += size) {
    const auto begin = pairs.begin() + static_cast<std::ptrdiff_t>(first);
    shards.emplace_back(begin,
                        begin + static_cast<std::ptrdiff_t>(std::min(size, pairs.size() - first)));
  }
  return shards;
}

// COLMAP's options for what differs from its defaults.
void AddMatchingOptions(const DescriptorMatchingOptions& matching,
                        std::map<std::string, std::string>* colmap_options) {
  const DescriptorMatchingOptions defaults;
  const auto add = [&](const char* name, auto value, auto default_value) {
    if (value == default_value) return;
    // The shortest text that stands for the same number.
    std::array<char, 32> text = {};
    const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
    (*colmap_options)[name] = std::string(text.data(), end);
  };
  add("max_ratio", matching.max_ratio, defaults.max_ratio);
  add("max_distance", matching.max_distance, defaults.max_distance);
  add("cross_check", matching.cross_check ? 1 : 0, defaults.cross_check ? 1 : 0);
  add("max_num_matches", matching.max_num_matches, defaults.max_num_matches);
}

// The value of an option, in whatever group it was given, or null.
const std::string* FindOption(const std::map<std::string, std::string>& options,
                              const std::string& name) {
  for (const auto& [key, value] : options) {
    if (key.substr(key.find('.') + 1) == name) return &value;
  }
  return nullptr;
}

}  // namespace

void ColmapVerifierOptions::Check() const {
  EffectiveNumThreads(num_threads);
  exact.Check();
  for (const char* name : {"max_ratio", "max_distance", "cross_check", "max_num_matches"}) {
    if (FindOption(colmap_options, name) == nullptr) continue;
    throw OptionsError(std::string(name) + " is an option of exact.matching.");
  }
  if (num_processes < 0) {
    throw OptionsError("The number of COLMAP processes must be positive, or 0 to have it chosen.");
  }
  if (min_num_inliers < 0) throw OptionsError("min_num_inliers must be at least 0.");
  if (max_pairs_per_shard < 1) throw OptionsError("A shard needs at least one pair.");
  if (!(timeout_per_pair > 0)) throw OptionsError("The timeout of a pair must be positive.");
  if (!(lock_timeout >= 0)) throw OptionsError("The lock timeout must not be negative.");
}

// What the calling thread and the workers share while a batch is verified.
struct ColmapVerifier::Batch {
  struct Part {
    std::vector<PairRows> results;
    std::vector<Failure> failures;
    bool from_colmap = true;
  };

  std::mutex mutex;
  std::condition_variable changed;            // finished, num_workers or abort.
  std::deque<std::vector<ImagePair>> shards;  // Not yet taken.
  std::deque<Part> finished;                  // Not yet merged.
  std::unordered_set<ImagePair> answered;     // All pairs that have been finished.
  int num_workers = 0;
  bool last_has_put_back = false;  // The last worker met a limit of the system, and tried again.
  std::exception_ptr exception;
  std::atomic<bool> abort{false};

  // Under the lock.
  void EndWorker() {
    --num_workers;
    changed.notify_all();
  }

  // The end of a worker, and of the batch.
  void Fail(std::exception_ptr with) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (!exception) exception = std::move(with);
    abort = true;
    EndWorker();
  }

  void Push(Part part) {
    const std::lock_guard<std::mutex> lock(mutex);
    for (const PairRows& rows : part.results) answered.insert(rows.pair);
    for (const Failure& failure : part.failures) answered.insert(failure.first);
    finished.push_back(std::move(part));
    changed.notify_all();
  }
};

ColmapVerifier::ColmapVerifier(const ColmapVerifierOptions& options,
                               const ColmapInstallation& colmap, Database& database,
                               const std::vector<ImageRecord>& images,
                               const std::filesystem::path& work_path, const StopRequest& stop,
                               const std::function<void(const std::string&)>& on_warning)
    : options_(options),
      colmap_(colmap),
      database_(database),
      work_path_(work_path),
      template_path_(work_path / "template.db"),
      stop_(stop),
      on_warning_(on_warning) {
  options_.Check();
  const bool gpu = options.use_gpu && colmap.has_gpu;
  const bool exact = options.matcher == ColmapVerifierOptions::Matcher::kExact ||
                     (options.matcher == ColmapVerifierOptions::Matcher::kAuto && !gpu);
  options_.use_gpu = gpu && !exact;
  for (const ImageRecord& image : images) images_.emplace(image.id, image);
  known_ = database.ReadVerifiedPairs(static_cast<std::size_t>(options.min_num_inliers));

  const int num_threads = EffectiveNumThreads(options.num_threads);
  num_processes_ = options.num_processes > 0 ? options.num_processes
                   : options_.use_gpu        ? 1
                                             : num_threads;
  threads_per_process_ = std::max(1, num_threads / num_processes_);

  if (exact) {
    exact_matcher_ = std::make_unique<ExactMatcher>(
        options.exact, database.Path(), images, sqlite::LockPatience(options.lock_timeout, &stop),
        static_cast<std::size_t>(num_processes_));
    unverified_ = database.ReadUnverifiedPairs();
    // Guided matching is COLMAP's: it matches once more where the geometry says so.
    const std::string* guided = FindOption(options.colmap_options, "guided_matching");
    shards_with_descriptors_ = guided != nullptr && *guided != "0";
  }

  // TwoViewGeometry::ConfigurationType: undefined, or degenerate.
  unmatched_config_ = std::make_pair(colmap.major, colmap.minor) < kFirstDegenerate ? 0 : 1;
  WarnOfCutFeatures(images);

  std::map<std::string, std::string> colmap_options = options.colmap_options;
  AddMatchingOptions(options.exact.matching, &colmap_options);
  colmap_options["use_gpu"] = options_.use_gpu ? "1" : "0";
  colmap_options["num_threads"] = std::to_string(threads_per_process_);
  colmap_options["min_num_inliers"] = std::to_string(options.min_num_inliers);
  std::vector<std::string> unknown;
  arguments_ = colmap.Arguments(colmap_options, &unknown);
  if (std::find(unknown.begin(), unknown.end(), kMatcherType) != unknown.end()) {
    throw OptionsError("COLMAP " + colmap.Version() + " does not have --" + kMatcherType + " " +
                       options.colmap_options.at(kMatcherType) +
                       ": it matches SIFT features in one way only. Leave the option out, or name "
                       "another COLMAP with --colmap_path.");
  }
  if (!unknown.empty()) {
    std::string names;
    for (const std::string& name : unknown) names += (names.empty() ? "" : ", ") + name;
    on_warning_("COLMAP " + colmap.Version() +
                " does not have these options, which have no effect: " + names + ".");
  }

  const std::filesystem::path output_path = work_path / "database_creator.txt";
  const SubprocessResult result = RunTwice(
      {colmap.executable.string(), "database_creator", "--database_path", template_path_.string()},
      output_path, kMinTimeoutSeconds, stop);
  if (!result.Succeeded() || !std::filesystem::exists(template_path_)) {
    ThrowIfUnusable(work_path);
    const std::string lines = LastLines(output_path, 5);
    throw ColmapError("`" + colmap.executable.string() + " database_creator` " + result.Describe() +
                      " and made no database in " + work_path.string() + ".\n" + lines +
                      (lines.empty() ? "" : "\n") +
                      "This COLMAP does not work; name another with --colmap_path.");
  }
}

void ColmapVerifier::CheckThatColmapWorks(const std::vector<PairRows>& results,
                                          const std::vector<Failure>& failures) {
  if (!results.empty()) {
    failing_images_.clear();
    return;
  }
  for (const auto& [pair, problem] : failures) {
    if (failing_images_.count(pair.id1) + failing_images_.count(pair.id2) > 0) continue;
    failing_images_.insert({pair.id1, pair.id2});
    if (failing_images_.size() < 2 * kMaxUnrelatedFailures) continue;
    throw ColmapError(
        (statistics_.num_verified == 0
             ? "COLMAP fails on every pair of images. The last time it "
             : "COLMAP has failed on " + std::to_string(kMaxUnrelatedFailures) +
                   " pairs in a row that have no image in common. The last time it ") +
        problem +
        (options_.use_gpu ? "\nThis COLMAP was built to use a GPU; on a machine "
                            "without one add --SiftMatching.use_gpu 0."
                          : "") +
        "\nWhat was verified before is kept.");
  }
}

void ColmapVerifier::WarnOfCutFeatures(const std::vector<ImageRecord>& images) const {
  if (!exact_matcher_) return;
  const int limit = options_.exact.matching.max_num_matches;
  const auto num_cut = std::count_if(images.begin(), images.end(), [&](const ImageRecord& image) {
    return image.num_features > static_cast<std::size_t>(limit);
  });
  if (num_cut == 0) return;
  on_warning_(std::to_string(num_cut) + " images have more than " + std::to_string(limit) +
              " features (max_num_matches); only so many of each are matched.");
}

VerifierStatistics ColmapVerifier::Statistics() const {
  VerifierStatistics statistics = statistics_;
  statistics.num_failed = num_failed_;
  if (exact_matcher_) {
    statistics.num_matched = exact_matcher_->NumPairs();
    statistics.num_image_reads = exact_matcher_->NumReads();
  }
  return statistics;
}

std::vector<ShardPair> ColmapVerifier::Match(const std::vector<ImagePair>& pairs, Batch* batch) {
  std::vector<ShardPair> to_verify;
  std::vector<ImagePair> to_match;
  for (const ImagePair& pair : pairs) {
    const bool has_matches = std::binary_search(unverified_.begin(), unverified_.end(), pair);
    if (exact_matcher_ == nullptr || has_matches) {
      to_verify.push_back({pair, std::nullopt});
    } else {
      to_match.push_back(pair);
    }
  }
  if (to_match.empty()) return to_verify;

  const double start = ThreadCpuSeconds();
  std::vector<std::vector<FeatureMatch>> matches;
  const auto should_stop = [&] { return stop_.Abandon() || batch->abort.load(); };
  if (!exact_matcher_->Match(to_match, should_stop, &matches)) return {};
  Batch::Part unmatched;
  unmatched.from_colmap = false;
  for (std::size_t i = 0; i < to_match.size(); ++i) {
    if (matches[i].size() < static_cast<std::size_t>(options_.min_num_inliers)) {
      PairRows rows;
      rows.pair = to_match[i];
      rows.config = unmatched_config_;
      rows.num_dropped_matches = matches[i].size();
      unmatched.results.push_back(std::move(rows));
    } else {
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(matches[i].data());
      to_verify.push_back(
          {to_match[i], sqlite::Blob(bytes, bytes + matches[i].size() * sizeof(FeatureMatch))});
    }
  }
  {
    const std::lock_guard<std::mutex> lock(batch->mutex);
    statistics_.matching_seconds += ThreadCpuSeconds() - start;
    statistics_.num_unmatched += unmatched.results.size();
  }
  if (!unmatched.results.empty()) batch->Push(std::move(unmatched));
  return to_verify;
}

std::string ColmapVerifier::TryShard(const std::vector<ShardPair>& pairs, Batch* batch,
                                     std::vector<PairRows>* results) {
  double timeout = options_.timeout_per_pair * static_cast<double>(pairs.size() + 1);
  {
    const std::lock_guard<std::mutex> lock(batch->mutex);
    if (slowest_seconds_per_pair_ > 0) {
      timeout = std::min(timeout, kMinTimeoutSeconds + kPatience * slowest_seconds_per_pair_ *
                                                           static_cast<double>(pairs.size()));
    }
  }
  const WorkDirectory shard(work_path_);
  const std::filesystem::path database_path = shard.Path() / "database.db";
  const std::filesystem::path list_path = shard.Path() / "pairs.txt";
  const std::filesystem::path output_path = shard.Path() / "output.txt";
  try {
    std::filesystem::copy_file(template_path_, database_path);
    FillShard(database_path, database_.Path(), {options_.lock_timeout, &stop_}, pairs,
              shards_with_descriptors_);
  } catch (const std::filesystem::filesystem_error& error) {
    ThrowIfUnusable(work_path_);
    throw FileError("Cannot make a shard in the working directory: " + std::string(error.what()) +
                    ". Name another directory with --GraphMatching.work_path.");
  } catch (const DatabaseError&) {
    ThrowIfUnusable(work_path_);
    throw;
  }
  std::ofstream list(list_path);
  for (const auto& [pair, matches] : pairs) {
    list << ShardImageName(pair.id1) << ' ' << ShardImageName(pair.id2) << '\n';
  }
  list.close();
  if (!list) ThrowIfUnusable(work_path_);
  if (!list) throw FileError("Cannot write " + list_path.string() + ". Is the disk full?");

  std::vector<std::string> command = {
      colmap_.executable.string(), "matches_importer", "--database_path", database_path.string(),
      "--match_list_path",         list_path.string(), "--match_type",    "pairs"};
  command.insert(command.end(), arguments_.begin(), arguments_.end());
  const SubprocessResult run = RunSubprocess(
      command, output_path, timeout, [&] { return stop_.Abandon() || batch->abort.load(); });
  {
    const std::lock_guard<std::mutex> lock(batch->mutex);
    statistics_.colmap_seconds += run.seconds;
  }
  if (run.ending == SubprocessResult::Ending::kStopped) return run.Describe();

  std::string problem;
  if (!run.Succeeded() &&
      LastLines(output_path, 8).find(std::strerror(EAGAIN)) != std::string::npos) {
    throw SystemLimitError(
        "COLMAP could not start its threads, and " + run.Describe() +
        ". The system lets this user or container have no more processes and threads: raise that "
        "limit (ulimit -u, Docker's --pids-limit), or use fewer with --SiftMatching.num_threads.");
  }
  if (!run.Succeeded()) {
    problem = run.Describe() + ":\n" + LastLines(output_path, 8);
  } else {
    try {
      std::map<ImageId, std::size_t> num_features;
      for (const auto& [pair, matches] : pairs) {
        num_features[pair.id1] = images_.at(pair.id1).num_features;
        num_features[pair.id2] = images_.at(pair.id2).num_features;
      }
      *results = ReadShard(database_path, pairs, num_features);
    } catch (const DatabaseError& error) {
      problem = std::string("ended without an error, but: ") + error.what() + "\n" +
                LastLines(output_path, 8);
    }
  }
  if (!problem.empty()) {
    ThrowIfUnusable(work_path_);
    return problem;
  }
  const std::lock_guard<std::mutex> lock(batch->mutex);
  statistics_.num_verified += pairs.size();
  slowest_seconds_per_pair_ =
      std::max(slowest_seconds_per_pair_, run.seconds / static_cast<double>(pairs.size()));
  return "";
}

void ColmapVerifier::ProcessShard(const std::vector<ShardPair>& pairs, Batch* batch) {
  Batch::Part part;
  std::string problem;
  for (int i = 0; i < kTries; ++i) {
    if (stop_.Abandon() || batch->abort) return;
    problem = TryShard(pairs, batch, &part.results);
    if (problem.empty()) {
      batch->Push(std::move(part));
      return;
    }
  }
  if (stop_.Abandon() || batch->abort) return;
  if (pairs.size() == 1) {
    part.failures.emplace_back(pairs.front().pair, problem);
    batch->Push(std::move(part));
    return;
  }
  const auto middle = pairs.begin() + static_cast<std::ptrdiff_t>(pairs.size() / 2);
  ProcessShard({pairs.begin(), middle}, batch);
  ProcessShard({middle, pairs.end()}, batch);
}

bool ColmapVerifier::PutBack(const std::vector<ImagePair>& shard, Batch* batch) {
  const std::lock_guard<std::mutex> lock(batch->mutex);
  const bool is_last = batch->num_workers == 1;
  // The others may have left only just now.
  if (is_last && std::exchange(batch->last_has_put_back, true)) throw;
  // What was finished of it is not to be done again.
  std::vector<ImagePair> left;
  std::copy_if(shard.begin(), shard.end(), std::back_inserter(left),
               [batch](const ImagePair& pair) { return batch->answered.count(pair) == 0; });
  batch->shards.push_front(std::move(left));
  if (is_last) return true;
  batch->EndWorker();
  num_processes_ = batch->num_workers;
  return false;
}

bool ColmapVerifier::WorkOnNextShard(Batch* batch, std::vector<ImagePair>* shard) {
  {
    std::unique_lock<std::mutex> lock(batch->mutex);
    // What is not in the database yet is lost if we are killed: it must not pile up.
    batch->changed.wait(lock, [&] {
      return batch->abort || batch->finished.size() <= static_cast<std::size_t>(num_processes_);
    });
    if (batch->shards.empty() || batch->abort || stop_.Requested()) {
      // Under the same lock: nobody is to leave pairs to a thread that goes.
      batch->EndWorker();
      return false;
    }
    *shard = std::move(batch->shards.front());
    batch->shards.pop_front();
  }
  const std::vector<ShardPair> to_verify = Match(*shard, batch);
  const auto size = static_cast<std::size_t>(options_.max_pairs_per_shard);
  for (std::size_t first = 0; first < to_verify.size(); first += size) {
    if (first > 0 && stop_.Requested()) break;
    const auto begin = to_verify.begin() + static_cast<std::ptrdiff_t>(first);
    const std::size_t num = std::min(size, to_verify.size() - first);
    ProcessShard({begin, begin + static_cast<std::ptrdiff_t>(num)}, batch);
  }
  return true;
}

void ColmapVerifier::Work(Batch* batch) {
  std::vector<ImagePair> shard;
  try {
    for (bool goes_on = true; goes_on;) {
      try {
        goes_on = WorkOnNextShard(batch, &shard);
      } catch (const SystemLimitError&) {
        goes_on = PutBack(shard, batch);
      }
    }
  } catch (const StoppedError&) {
    // While it waited for the database: the others finish what they have.
    const std::lock_guard<std::mutex> lock(batch->mutex);
    batch->EndWorker();
  } catch (...) {
    batch->Fail(std::current_exception());
  }
}

std::vector<VerifiedPair> ColmapVerifier::Write(const std::vector<PairRows>& results) {
  std::vector<VerifiedPair> written;
  if (results.empty()) return written;
  const std::vector<TestedPair> of_others = database_.WritePairs(results);
  auto other = of_others.begin();
  for (const PairRows& rows : results) {
    VerifiedPair verified;
    verified.pair = rows.pair;
    std::size_t num_inliers = rows.num_inliers;
    int config = rows.config;
    if (other != of_others.end() && other->pair == rows.pair) {
      num_inliers = other->num_inliers;
      config = other->config;
      ++other;
    } else {
      verified.num_matches = static_cast<std::int32_t>(rows.num_matches + rows.num_dropped_matches);
    }
    const bool is_edge =
        IsEdge(num_inliers, config, static_cast<std::size_t>(options_.min_num_inliers));
    verified.outcome = is_edge ? PairOutcome::kEdge : PairOutcome::kNoEdge;
    verified.num_inliers = static_cast<std::uint32_t>(num_inliers);
    written.push_back(verified);
  }
  return written;
}

bool ColmapVerifier::Verify(const std::vector<ImagePair>& pairs,
                            const std::function<void(const VerifiedPair&)>& on_verified) {
  Batch batch;
  // Shards are cut before known pairs are taken out: a run that goes on after an interruption then
  // gives COLMAP the same shards, and gets the same answers, as one that was never interrupted.
  std::size_t num_unanswered = 0;
  const std::size_t factor = MatchesHere() ? kPairsMatchedPerVerified : 1;
  for (std::vector<ImagePair>& shard :
       CutIntoShards(pairs, factor * kMinPairsPerShard,
                     factor * static_cast<std::size_t>(options_.max_pairs_per_shard))) {
    const auto unknown_end = std::stable_partition(
        shard.begin(), shard.end(),
        [this](const ImagePair& pair) { return FindPair(known_, pair) == nullptr; });
    for (auto pair = unknown_end; pair != shard.end(); ++pair)
      on_verified(*FindPair(known_, *pair));
    shard.erase(unknown_end, shard.end());
    num_unanswered += shard.size();
    if (!shard.empty()) batch.shards.push_back(std::move(shard));
  }
  if (num_unanswered == 0) return true;

  const std::size_t num_wanted =
      std::min(batch.shards.size(), static_cast<std::size_t>(num_processes_));
  // They begin when it is known how many they are.
  std::unique_lock<std::mutex> starting(batch.mutex);
  ThreadGroup workers(num_wanted, [this, &batch] {
    { const std::lock_guard<std::mutex> started(batch.mutex); }
    Work(&batch);
  });
  // Where the system gives no thread, this one takes turns.
  const bool works_itself = workers.Size() == 0;
  batch.num_workers = works_itself ? 1 : static_cast<int>(workers.Size());
  starting.unlock();

  try {
    std::vector<ImagePair> own_shard;
    std::unique_lock<std::mutex> lock(batch.mutex);
    while (true) {
      if (works_itself && batch.finished.empty() && batch.num_workers > 0) {
        lock.unlock();
        WorkOnNextShard(&batch, &own_shard);
        lock.lock();
        continue;
      }
      batch.changed.wait(lock, [&] { return !batch.finished.empty() || batch.num_workers == 0; });
      if (batch.finished.empty()) break;
      const Batch::Part part = std::move(batch.finished.front());
      batch.finished.pop_front();
      batch.changed.notify_all();
      lock.unlock();
      if (part.from_colmap) CheckThatColmapWorks(part.results, part.failures);
      for (const VerifiedPair& verified : Write(part.results)) {
        --num_unanswered;
        on_verified(verified);
      }
      for (const auto& [pair, problem] : part.failures) {
        on_warning_("COLMAP failed on the pair \"" + ImageName(pair.id1) + "\" and \"" +
                    ImageName(pair.id2) + "\", which stays untested. It " + problem);
        --num_unanswered;
        ++num_failed_;
        on_verified({pair, PairOutcome::kFailed, 0});
      }
      lock.lock();
    }
  } catch (...) {
    {
      const std::lock_guard<std::mutex> lock(batch.mutex);
      batch.abort = true;
      batch.changed.notify_all();
    }
    workers.Join();
    try {
      throw;
    } catch (const StoppedError&) {
      return false;  // While it waited for the database: what could not be written is given up.
    }
  }
  workers.Join();
  if (batch.exception) std::rethrow_exception(batch.exception);
  return num_unanswered == 0;
}

}  // namespace colmap_graphmatch
