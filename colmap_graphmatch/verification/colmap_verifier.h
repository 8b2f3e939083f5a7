#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/database/shard.h"
#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/exact_matcher.h"

namespace colmap_graphmatch {

struct ColmapVerifierOptions {
  // Who matches descriptors; COLMAP gets the options of exact.matching. kAuto: COLMAP if it has a
  // GPU and may use it, else this library.
  enum class Matcher { kAuto, kExact, kColmap };
  Matcher matcher = Matcher::kAuto;

  ExactMatcherOptions exact;

  // The cores that all COLMAP processes together may use; -1: all.
  int num_threads = -1;

  // COLMAP processes at a time; each gets num_threads / num_processes threads. 0: num_threads
  // processes of one thread without a GPU, and one process with it (docs/design.md). Descriptors
  // are matched by one thread for each process, when that process does not run.
  int num_processes = 0;

  // Whether COLMAP matches on the GPU; without effect on a COLMAP that was built without.
  bool use_gpu = true;

  // A pair is an edge with this many inliers, 0 being as good as 1. Also handed to COLMAP.
  int min_num_inliers = 15;

  // Other options of COLMAP's feature matching and geometric verification, by their names in any
  // version (e.g. "SiftMatching.max_error") or without a group, as COLMAP is to get them. What is
  // not here keeps COLMAP's own default. Those of exact.matching do not belong here: COLMAP gets
  // them from there.
  std::map<std::string, std::string> colmap_options;

  // Pairs a shard at most, the amount of work that a crash of COLMAP or kill -9 can lose.
  int max_pairs_per_shard = 64;

  // Seconds that COLMAP may take for a pair before it counts as hanging. Once shards have come
  // back, one that takes more than 20 times as long a pair as the slowest of them counts as
  // hanging, too.
  double timeout_per_pair = 60;

  // Seconds to wait for locks of other processes on the user's database.
  double lock_timeout = 60;

  // Throws OptionsError.
  void Check() const;
};

struct VerifierStatistics {
  // CPU time of matching descriptors here, summed over threads, and the time in which COLMAP ran,
  // summed over processes.
  double matching_seconds = 0;
  double colmap_seconds = 0;

  std::size_t num_matched = 0;    // Pairs whose descriptors were matched here,
  std::size_t num_unmatched = 0;  // those of them with fewer matches than an edge needs inliers.
  std::size_t num_verified = 0;   // Pairs that COLMAP verified,
  std::size_t num_failed = 0;     // and those on which it failed.
  std::size_t num_image_reads = 0;
};

// Has pairs matched and verified, in shards (see docs/design.md), and writes what COLMAP found in a
// shard to the user's database in one transaction. Descriptors are matched here or by COLMAP; the
// geometric verification is always COLMAP's. Pairs with fewer matches here than an edge needs
// inliers never reach COLMAP and get the rows that it would write.
//
// A shard on which COLMAP crashes, hangs or writes nonsense is tried again, then halved until the
// pair that is to blame is alone; that one is reported as kFailed and through on_warning, and stays
// untested in the database. If COLMAP fails on several pairs in a row that have no image in common,
// Verify throws ColmapError with COLMAP's last words. Where the system allows fewer threads or
// processes than are asked for, it works with those that it gets; with no process at all, Verify
// throws SystemLimitError.
class ColmapVerifier : public PairVerifier {
 public:
  // images: those of the database. work_path: an existing directory for the shards. stop and
  // database must outlive the verifier. on_warning is called on the thread that calls the
  // constructor or Verify. Throws ColmapError if COLMAP cannot make an empty database.
  ColmapVerifier(const ColmapVerifierOptions& options, const ColmapInstallation& colmap,
                 Database& database, const std::vector<ImageRecord>& images,
                 const std::filesystem::path& work_path, const StopRequest& stop,
                 const std::function<void(const std::string&)>& on_warning);

  // The number of COLMAP processes at a time, and of threads in each.
  int NumProcesses() const { return num_processes_; }
  int NumThreadsPerProcess() const { return threads_per_process_; }
  bool UsesGpu() const { return options_.use_gpu; }
  bool MatchesHere() const { return exact_matcher_ != nullptr; }

  // Of all calls of Verify so far. Not to be called during one on another thread.
  VerifierStatistics Statistics() const;

  const std::vector<VerifiedPair>& KnownPairs() const override { return known_; }
  bool Verify(const std::vector<ImagePair>& pairs,
              const std::function<void(const VerifiedPair&)>& on_verified) override;

 private:
  struct Batch;
  using Failure = std::pair<ImagePair, std::string>;  // And what COLMAP said.

  std::string ImageName(ImageId image_id) const { return images_.at(image_id).name; }
  // What a worker thread does: takes shards until none is left.
  void Work(Batch* batch);
  // False if there is none, and the worker ends.
  bool WorkOnNextShard(Batch* batch, std::vector<ImagePair>* shard);
  // While a SystemLimitError is handled: puts back what is left of a worker's shard, and has the
  // worker end, since with one less there may be room for the others. True if it was the last one
  // and is to go on; rethrows the error if it has done so before.
  bool PutBack(const std::vector<ImagePair>& shard, Batch* batch);
  // Matches the pairs here. Those with too few matches are done; returns the others.
  std::vector<ShardPair> Match(const std::vector<ImagePair>& pairs, Batch* batch);
  void ProcessShard(const std::vector<ShardPair>& pairs, Batch* batch);
  // One run of COLMAP on the pairs. An empty string if it went well; otherwise what went wrong.
  std::string TryShard(const std::vector<ShardPair>& pairs, Batch* batch,
                       std::vector<PairRows>* results);
  // Writes results to the database and returns what it has of these pairs from then on.
  std::vector<VerifiedPair> Write(const std::vector<PairRows>& results);
  void WarnOfCutFeatures(const std::vector<ImageRecord>& images) const;
  // Throws ColmapError once COLMAP has failed on pairs that have nothing in common.
  void CheckThatColmapWorks(const std::vector<PairRows>& results,
                            const std::vector<Failure>& failures);

  ColmapVerifierOptions options_;
  ColmapInstallation colmap_;
  Database& database_;
  std::map<ImageId, ImageRecord> images_;
  std::filesystem::path work_path_;
  std::filesystem::path template_path_;  // An empty database, made by the installed COLMAP.
  const StopRequest& stop_;
  std::function<void(const std::string&)> on_warning_;
  int num_processes_ = 1;  // Guarded by the mutex of the batch once it may become less.
  int threads_per_process_ = 1;
  std::vector<std::string> arguments_;           // Of every run of matches_importer.
  std::vector<VerifiedPair> known_;              // Ascending.
  std::unique_ptr<ExactMatcher> exact_matcher_;  // None if COLMAP matches.
  std::vector<ImagePair> unverified_;  // Ascending; their matches are in the database already.
  bool shards_with_descriptors_ = true;
  int unmatched_config_ = 0;  // What COLMAP stores for pairs with too few matches.

  std::size_t num_failed_ = 0;

  // Guarded by the mutex of the batch.
  double slowest_seconds_per_pair_ = 0;  // 0 until a shard came back.
  VerifierStatistics statistics_;
  std::set<ImageId>
      failing_images_;  // Of failures since the last success, no image in two of them.
};

}  // namespace colmap_graphmatch
