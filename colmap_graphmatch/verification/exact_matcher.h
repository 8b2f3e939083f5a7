#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/matching/descriptor_cache.h"
#include "colmap_graphmatch/matching/descriptor_matcher.h"
#include "colmap_graphmatch/verification/options.h"

namespace colmap_graphmatch {

// The matches of a pair and, if they are asked for, of each where it is and how distinct
// (DescriptorMatcher).
struct MatchedPair {
  FeatureMatches matches;
  std::vector<PointPair> points;
  std::vector<float> distinctness;
};

// Matches the descriptors of pairs of images of a database. Thread-safe.
class ExactMatcher {
 public:
  enum class Points { kLeftOut, kGiven };

  // images: those of the database. num_threads: how many will call Match at a time. Nothing is read
  // yet.
  ExactMatcher(const ExactMatcherOptions& options, Points points,
               const std::filesystem::path& database_path, const std::vector<ImageRecord>& images,
               const sqlite::LockPatience& patience, std::size_t num_threads);

  // The matches of every pair, on the calling thread alone, while the images of the pairs that come
  // next are read. Returns false if should_stop, which is asked before every pair, ended it early.
  // Throws DatabaseError, also if an image has not as many features as it had.
  bool Match(const std::vector<ImagePair>& pairs, const std::function<bool()>& should_stop,
             std::vector<MatchedPair>* matched);

  // Pairs matched so far.
  std::size_t NumPairs() const { return num_pairs_; }

  // Images read from the database so far; some more than once if the cache is small.
  std::size_t NumReads() const { return cache_.NumReads(); }

 private:
  ExactMatcherOptions options_;
  Points points_;
  std::map<ImageId, ImageRecord> images_;
  DescriptorCache cache_;
  std::atomic<std::size_t> num_pairs_{0};
};

}  // namespace colmap_graphmatch
