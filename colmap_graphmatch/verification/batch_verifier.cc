#include "colmap_graphmatch/verification/batch_verifier.h"

#include <algorithm>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/matching/pair_order.h"
#include "colmap_graphmatch/verification/fault_isolation.h"
#include "colmap_graphmatch/verification/points.h"

namespace colmap_graphmatch {
namespace {

// A batch is cut into about this many shards, so that up to as many processes have something to do.
// Fixed: what a shard contains must not depend on the number of cores.
constexpr std::size_t kShardsPerBatch = 64;
constexpr std::size_t kShardsOfSmallBatch = 8;

// Below this the start of COLMAP and the copy of the features would cost more than a few per cent.
constexpr std::size_t kMinPairsPerShard = 8;

// How many times as many pairs are matched here at a time as COLMAP gets at most: where pairs are
// rare that have enough matches, COLMAP would otherwise be started for one or two of them.
constexpr std::size_t kPairsMatchedPerVerified = 4;

// Pairs in a row, no two of them with an image in common and no other pair verified between them,
// on which COLMAP has to fail to be given up. One bad image fails in many pairs, and they come
// together.
constexpr std::size_t kMaxUnrelatedFailures = 4;

// Pairs that share images come into the same shard, and shards that do follow each other.
// min_size: where a batch would otherwise keep few cores busy; usual_size: else.
std::vector<ShardRunner::Shard> CutIntoShards(std::vector<ImagePair> pairs, std::size_t min_size,
                                              std::size_t usual_size, std::size_t max_size) {
  SortForReuse(&pairs);
  const auto part = [&pairs](std::size_t num) { return (pairs.size() + num - 1) / num; };
  const std::size_t least = std::clamp(part(kShardsOfSmallBatch), min_size, usual_size);
  const std::size_t size = std::min(std::max(part(kShardsPerBatch), least), max_size);
  std::vector<ShardRunner::Shard> shards;
  for (std::size_t first = 0; first < pairs.size(); first += size) {
    const auto begin = pairs.begin() + static_cast<std::ptrdiff_t>(first);
    shards.emplace_back(begin,
                        begin + static_cast<std::ptrdiff_t>(std::min(size, pairs.size() - first)));
  }
  return shards;
}

// Whether Write found that another program had verified the pair in the meantime.
bool IsOfOthers(const VerifiedPair& written) { return written.num_matches < 0; }

}  // namespace

BatchVerifier::BatchVerifier(const VerificationOptions& options, const VerificationPlan& plan,
                             GeometryVerifier& geometry, Database& database,
                             const std::vector<ImageRecord>& images, const StopRequest& stop,
                             const std::function<void(const std::string&)>& on_warning)
    : options_(options),
      geometry_(geometry),
      database_(database),
      stop_(stop),
      on_warning_(on_warning),
      runner_(static_cast<std::size_t>(plan.num_processes), stop) {
  for (const ImageRecord& image : images) images_.emplace(image.id, image);
  known_ = database.ReadVerifiedPairs(static_cast<std::size_t>(options.geometry.min_num_inliers));
  if (!plan.matches_here) return;
  exact_matcher_ = std::make_unique<ExactMatcher>(
      options.exact,
      geometry.NeedsPoints() ? ExactMatcher::Points::kGiven : ExactMatcher::Points::kLeftOut,
      database.Path(), images, sqlite::LockPatience(options.lock_timeout, &stop),
      static_cast<std::size_t>(plan.num_processes));
  unverified_ = database.ReadUnverifiedPairs();
  if (geometry.NeedsPoints() && !unverified_.empty()) {
    reader_.emplace(database.Path(), sqlite::Access::kRead,
                    sqlite::LockPatience(options.lock_timeout, &stop));
  }
  WarnOfCutFeatures(images);
}

void BatchVerifier::WarnOfCutFeatures(const std::vector<ImageRecord>& images) const {
  if (!exact_matcher_) return;
  const int limit = options_.exact.matching.max_num_matches;
  const auto num_cut = std::count_if(images.begin(), images.end(), [&](const ImageRecord& image) {
    return image.num_features > static_cast<std::size_t>(limit);
  });
  if (num_cut == 0) return;
  on_warning_(std::to_string(num_cut) + " images have more than " + std::to_string(limit) +
              " features (max_num_matches); only so many of each are matched.");
}

MatchingStatistics BatchVerifier::Statistics() const {
  MatchingStatistics statistics;
  statistics.seconds = matching_seconds_;
  statistics.num_unmatched = num_unmatched_;
  statistics.num_failed = num_failed_;
  if (exact_matcher_) {
    statistics.num_matched = exact_matcher_->NumPairs();
    statistics.num_image_reads = exact_matcher_->NumReads();
  }
  return statistics;
}

void BatchVerifier::CheckThatItWorks(const ShardPart& part) {
  if (!part.is_verified) return;
  if (!part.results.empty()) {
    failing_images_.clear();
    has_verified_ = true;
    return;
  }
  for (const auto& [pair, problem] : part.failures) {
    if (failing_images_.count(pair.id1) + failing_images_.count(pair.id2) > 0) continue;
    failing_images_.insert({pair.id1, pair.id2});
    if (failing_images_.size() < 2 * kMaxUnrelatedFailures) continue;
    const std::string advice = geometry_.AdviceOnFailure();
    throw ColmapError((has_verified_
                           ? "COLMAP has failed on " + std::to_string(kMaxUnrelatedFailures) +
                                 " pairs in a row that have no image in common."
                           : std::string("COLMAP fails on every pair of images.")) +
                      " The last time it " + problem + (advice.empty() ? "" : "\n" + advice) +
                      "\nWhat was verified before is kept.");
  }
}

std::vector<PairToVerify> BatchVerifier::Match(const ShardRunner::Shard& pairs,
                                               ShardRunner::Progress& progress) {
  std::vector<PairToVerify> to_verify;
  std::vector<ImagePair> to_match;
  for (const ImagePair& pair : pairs) {
    const bool has_matches = std::binary_search(unverified_.begin(), unverified_.end(), pair);
    if (exact_matcher_ == nullptr || has_matches) {
      to_verify.push_back(reader_ ? ReadPair(pair) : PairToVerify{pair, std::nullopt});
    } else {
      to_match.push_back(pair);
    }
  }
  if (to_match.empty()) return to_verify;

  const double start = ThreadCpuSeconds();
  std::vector<MatchedPair> matched;
  const auto should_stop = [&progress] { return progress.GivesUp(); };
  if (!exact_matcher_->Match(to_match, should_stop, &matched)) return {};
  ShardPart unmatched;
  unmatched.is_verified = false;
  for (std::size_t i = 0; i < to_match.size(); ++i) {
    if (matched[i].matches.size() < static_cast<std::size_t>(options_.geometry.min_num_inliers)) {
      PairGeometry result;
      result.pair = to_match[i];
      result.num_dropped_matches = matched[i].matches.size();
      result.geometry.configuration = geometry_.ConfigurationOfUnmatched();
      unmatched.results.push_back(std::move(result));
    } else {
      to_verify.push_back({to_match[i], std::move(matched[i].matches), std::move(matched[i].points),
                           std::move(matched[i].distinctness)});
    }
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    matching_seconds_ += ThreadCpuSeconds() - start;
    num_unmatched_ += unmatched.results.size();
  }
  if (!unmatched.results.empty()) progress.Finish(std::move(unmatched));
  return to_verify;
}

PairToVerify BatchVerifier::ReadPair(const ImagePair& pair) {
  const std::lock_guard<std::mutex> lock(reading_);
  PairToVerify read{pair, reader_->ReadMatches(pair)};
  const auto positions_of = [this](ImageId image) {
    return PositionsOf(reader_->ReadKeypoints(images_.at(image)));
  };
  read.points = PointsOf(*read.matches, positions_of(pair.id1), positions_of(pair.id2));
  return read;
}

void BatchVerifier::Work(const ShardRunner::Shard& shard, ShardRunner::Progress& progress) {
  const std::vector<PairToVerify> to_verify = Match(shard, progress);
  const auto size = static_cast<std::size_t>(options_.max_pairs_per_shard);
  for (std::size_t first = 0; first < to_verify.size(); first += size) {
    if (first > 0 && stop_.Requested()) break;
    const auto begin = to_verify.begin() + static_cast<std::ptrdiff_t>(first);
    const std::size_t num = std::min(size, to_verify.size() - first);
    VerifyAndIsolate(geometry_, {begin, begin + static_cast<std::ptrdiff_t>(num)}, progress);
  }
}

std::vector<VerifiedPair> BatchVerifier::Write(const std::vector<PairGeometry>& results) {
  std::vector<VerifiedPair> written;
  if (results.empty()) return written;
  const std::vector<TestedPair> of_others = database_.WritePairs(results);
  auto other = of_others.begin();
  for (const PairGeometry& result : results) {
    VerifiedPair verified;
    verified.pair = result.pair;
    std::size_t num_inliers = result.geometry.inliers.size();
    int config = static_cast<int>(result.geometry.configuration);
    if (other != of_others.end() && other->pair == result.pair) {
      num_inliers = other->num_inliers;
      config = other->config;
      ++other;
    } else {
      verified.num_matches =
          static_cast<std::int32_t>(result.matches.size() + result.num_dropped_matches);
    }
    const bool is_edge =
        IsEdge(num_inliers, config, static_cast<std::size_t>(options_.geometry.min_num_inliers));
    verified.outcome = is_edge ? PairOutcome::kEdge : PairOutcome::kNoEdge;
    verified.num_inliers = static_cast<std::uint32_t>(num_inliers);
    written.push_back(verified);
  }
  return written;
}

std::deque<ShardRunner::Shard> BatchVerifier::Cut(
    const std::vector<ImagePair>& pairs,
    const std::function<void(const VerifiedPair&)>& on_verified) const {
  // Shards are cut before known pairs are taken out: a run that goes on after an interruption then
  // gives COLMAP the same shards, and gets the same answers, as one that was never interrupted.
  std::deque<ShardRunner::Shard> shards;
  const std::size_t factor = exact_matcher_ ? kPairsMatchedPerVerified : 1;
  const std::size_t min_size = factor * kMinPairsPerShard;
  for (ShardRunner::Shard& shard :
       CutIntoShards(pairs, min_size, geometry_.UsualSizeOfShards() * min_size,
                     factor * static_cast<std::size_t>(options_.max_pairs_per_shard))) {
    const auto unknown_end = std::stable_partition(
        shard.begin(), shard.end(),
        [this](const ImagePair& pair) { return FindPair(known_, pair) == nullptr; });
    for (auto pair = unknown_end; pair != shard.end(); ++pair) {
      on_verified(*FindPair(known_, *pair));
    }
    shard.erase(unknown_end, shard.end());
    if (!shard.empty()) shards.push_back(std::move(shard));
  }
  return shards;
}

bool BatchVerifier::Verify(const std::vector<ImagePair>& pairs,
                           const std::function<void(const VerifiedPair&)>& on_verified) {
  std::deque<ShardRunner::Shard> shards = Cut(pairs, on_verified);
  if (shards.empty()) return true;
  std::size_t num_unanswered = 0;
  for (const ShardRunner::Shard& shard : shards) num_unanswered += shard.size();
  const auto merge = [&](const ShardPart& part) {
    CheckThatItWorks(part);
    std::vector<VerifiedPair> written;
    try {
      written = Write(part.results);
    } catch (const StoppedError&) {
      on_warning_(
          "Another program keeps the database locked: the last results could not be written and "
          "are given up. The next run verifies these pairs again.");
      throw;
    }
    for (std::size_t i = 0; i < written.size(); ++i) {
      --num_unanswered;
      inliers_of_ = ImagePair();
      if (!IsOfOthers(written[i])) {
        inliers_of_ = written[i].pair;
        inliers_ = part.results[i].geometry.inliers;
      }
      on_verified(written[i]);
    }
    for (const auto& [pair, problem] : part.failures) {
      on_warning_("COLMAP failed on the pair \"" + images_.at(pair.id1).name + "\" and \"" +
                  images_.at(pair.id2).name + "\", which stays untested. It " + problem);
      --num_unanswered;
      ++num_failed_;
      on_verified({pair, PairOutcome::kFailed, 0});
    }
  };
  runner_.Run(
      std::move(shards),
      [this](const ShardRunner::Shard& shard, ShardRunner::Progress& progress) {
        Work(shard, progress);
      },
      merge);
  return num_unanswered == 0;
}

const FeatureMatches& BatchVerifier::Inliers(const ImagePair& pair) {
  if (inliers_of_ != pair) {
    inliers_of_ = ImagePair();
    try {
      inliers_ = database_.ReadInliers(pair);
    } catch (const DamagedMatchesError& error) {
      // They are evidence for other pairs, no more.
      inliers_.clear();
      if (!std::exchange(said_inliers_are_damaged_, true)) {
        on_warning_(std::string(error.what()) +
                    " The run goes on without them, and says nothing of others.");
      }
    }
    inliers_of_ = pair;
  }
  return inliers_;
}

}  // namespace colmap_graphmatch
