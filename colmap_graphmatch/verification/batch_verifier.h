#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/verification/exact_matcher.h"
#include "colmap_graphmatch/verification/geometry_verifier.h"
#include "colmap_graphmatch/verification/options.h"
#include "colmap_graphmatch/verification/plan.h"
#include "colmap_graphmatch/verification/shard_runner.h"

namespace colmap_graphmatch {

// Of a BatchVerifier, so far.
struct MatchingStatistics {
  double seconds = 0;             // CPU time of matching descriptors here, summed over threads.
  std::size_t num_matched = 0;    // Pairs whose descriptors were matched here,
  std::size_t num_unmatched = 0;  // those of them with fewer matches than an edge needs inliers.
  std::size_t num_image_reads = 0;
  std::size_t num_failed = 0;  // Pairs on which the geometric verification failed.
};

// The PairVerifier of a database (docs/design.md): answers what is known, cuts batches into shards,
// has descriptors matched here (or leaves that to the GeometryVerifier) and geometries verified,
// and writes what a shard gave to the database in one transaction. Pairs with fewer matches than an
// edge needs inliers are not verified and get the rows that COLMAP would write.
//
// A pair on which verification fails is reported as kFailed and through on_warning, and stays
// untested in the database. If it fails on several pairs in a row that have no image in common,
// Verify throws ColmapError with COLMAP's last words.
class BatchVerifier : public PairVerifier {
 public:
  // images: those of the database. geometry, database and stop must outlive the verifier.
  // on_warning is called on the thread that calls the constructor or Verify.
  BatchVerifier(const VerificationOptions& options, const VerificationPlan& plan,
                GeometryVerifier& geometry, Database& database,
                const std::vector<ImageRecord>& images, const StopRequest& stop,
                const std::function<void(const std::string&)>& on_warning);

  // Of all calls of Verify so far. Not to be called during one on another thread.
  MatchingStatistics Statistics() const;

  const std::vector<VerifiedPair>& KnownPairs() const override { return known_; }
  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override;
  // None where the database has no valid ones, of which it warns once.
  const FeatureMatches& Inliers(const ImagePair& pair) override;

 private:
  // The shards of what is not known, which is reported.
  std::deque<ShardRunner::Shard> Cut(
      const std::vector<ImagePair>& pairs,
      const std::function<void(const VerifiedPair&)>& on_verified) const;
  // What a worker does with a shard.
  void Work(const ShardRunner::Shard& shard, ShardRunner::Progress& progress);
  // Matches the pairs here. Those with too few matches are finished; returns the others.
  std::vector<PairToVerify> Match(const ShardRunner::Shard& pairs, ShardRunner::Progress& progress);
  // With the matches and points that the database has.
  PairToVerify ReadPair(const ImagePair& pair);
  // Writes results to the database and returns what it has of these pairs from then on.
  std::vector<VerifiedPair> Write(const std::vector<PairGeometry>& results);
  // Throws ColmapError once verification has failed on pairs that have nothing in common.
  void CheckThatItWorks(const ShardPart& part);
  void WarnOfCutFeatures(const std::vector<ImageRecord>& images) const;

  VerificationOptions options_;
  GeometryVerifier& geometry_;
  Database& database_;
  const StopRequest& stop_;
  std::function<void(const std::string&)> on_warning_;
  ShardRunner runner_;
  std::vector<VerifiedPair> known_;  // Ascending.
  ImagePair inliers_of_;             // The pair that Inliers was asked for last, or that was
  FeatureMatches inliers_;           // reported last.
  bool said_inliers_are_damaged_ = false;
  std::unique_ptr<ExactMatcher> exact_matcher_;  // None if COLMAP matches.
  std::vector<ImagePair> unverified_;  // Ascending; their matches are in the database already.
  // Of failures since the last success, no image in two of them.
  std::set<ImageId> failing_images_;
  bool has_verified_ = false;
  std::size_t num_failed_ = 0;

  std::mutex reading_;              // Of the database by workers.
  std::optional<Database> reader_;  // None if nobody needs points.
  std::map<ImageId, ImageRecord> images_;

  std::mutex mutex_;  // Of what workers add to.
  double matching_seconds_ = 0;
  std::size_t num_unmatched_ = 0;
};

}  // namespace colmap_graphmatch
