#include "colmap_graphmatch/verification/exact_matcher.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/verification/points.h"

namespace colmap_graphmatch {
namespace {

// The pair that is matched, and those after it whose images are on their way meanwhile: reading an
// image takes much less time than matching a pair, unless the disk is slow.
constexpr std::size_t kLookahead = 4;

// A thread that reads keeps up with many that match.
std::size_t NumReaders(std::size_t num_threads) {
  return std::clamp<std::size_t>(num_threads / 8, 1, 4);
}

std::size_t CacheBytes(double cache_gb) {
  if (cache_gb == 0) return DefaultCacheBytes();
  constexpr auto kMost = std::numeric_limits<std::size_t>::max() / 2;
  const double bytes = cache_gb * 1e9;
  return bytes < static_cast<double>(kMost) ? static_cast<std::size_t>(bytes) : kMost;
}

std::map<ImageId, ImageRecord> ById(const std::vector<ImageRecord>& images) {
  std::map<ImageId, ImageRecord> by_id;
  for (const ImageRecord& image : images) by_id.emplace(image.id, image);
  return by_id;
}

}  // namespace

void ExactMatcherOptions::Check() const {
  matching.Check();
  if (!(cache_gb >= 0 && std::isfinite(cache_gb))) {
    throw OptionsError("cache_gb must be positive, or 0 to have it chosen.");
  }
}

ExactMatcher::ExactMatcher(const ExactMatcherOptions& options, Points points,
                           const std::filesystem::path& database_path,
                           const std::vector<ImageRecord>& images,
                           const sqlite::LockPatience& patience, std::size_t num_threads)
    : options_(options),
      points_(points),
      images_(ById(images)),
      cache_(CacheBytes(options.cache_gb), NumReaders(num_threads),
             [this, database_path, patience]() -> DescriptorCache::Reader {
               const auto database =
                   std::make_shared<Database>(database_path, sqlite::Access::kRead, patience);
               return [this, database](ImageId image) {
                 MatchingFeatures features{database->ReadDescriptors(images_.at(image)).data};
                 if (points_ == Points::kGiven) {
                   features.positions = PositionsOf(database->ReadKeypoints(images_.at(image)));
                 }
                 return features;
               };
             }) {}

bool ExactMatcher::Match(const std::vector<ImagePair>& pairs,
                         const std::function<bool()>& should_stop,
                         std::vector<MatchedPair>* matched) {
  DescriptorMatcher matcher(options_.matching);
  std::deque<std::pair<DescriptorCache::Handle, DescriptorCache::Handle>> requested;
  std::size_t next = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (should_stop()) return false;
    for (; next < std::min(i + kLookahead, pairs.size()); ++next) {
      requested.emplace_back(cache_.Request(pairs[next].id1), cache_.Request(pairs[next].id2));
    }
    const auto [handle1, handle2] = std::move(requested.front());
    requested.pop_front();
    const MatchingFeatures& features1 = cache_.Wait(handle1);
    const MatchingFeatures& features2 = cache_.Wait(handle2);
    ++num_pairs_;
    MatchedPair& pair = matched->emplace_back();
    if (points_ == Points::kLeftOut) {
      pair.matches = matcher.Match(features1.View(), features2.View());
    } else {
      pair.matches = matcher.Match(features1.View(), features2.View(), &pair.distinctness);
      pair.points = PointsOf(pair.matches, features1.positions, features2.positions);
    }
  }
  return true;
}

}  // namespace colmap_graphmatch
