#pragma once

#include <optional>
#include <vector>

#include "colmap_graphmatch/base/messages.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/graph/image_priors.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"
#include "colmap_graphmatch/pipeline/observer.h"
#include "colmap_graphmatch/pipeline/options.h"
#include "colmap_graphmatch/vectors/checkpoint.h"
#include "colmap_graphmatch/vectors/image_ranker.h"

namespace colmap_graphmatch {

// What a run does with the database and with what earlier runs kept.
enum class RunKind {
  kMatch,       // Writes to both.
  kCandidates,  // Reads the database; keeps its vectors for the next run.
  kReplay,      // Reads the database alone: nothing of it is for the next run on these photos.
};

// What every run begins with: its threads, the database and its images, what earlier runs kept, and
// the lists that say which pairs count.
class RunSetup {
 public:
  // Warns of what the run has to do without. What is passed by reference must outlive it. Throws
  // the errors of base/errors.h.
  RunSetup(RunKind run_kind, const PipelineOptions& run_options, const StopRequest& run_stop,
           PipelineObserver& observer);

  // Reads match_list_path and image_list_path.
  void ReadLists();

  // The steps from features to ranked lists.
  ImageRanker MakeRanker();

  // Those of a run on these images, by vertex.
  PairRestrictions RestrictionsOf(const std::vector<ImageRecord>& run_images);

  // What is known of these images beside their features, by vertex.
  ImagePriors PriorsOf(const std::vector<ImageRecord>& run_images);

  sqlite::LockPatience Patience() const;

  const RunKind kind;
  const PipelineOptions& options;
  const StopRequest& stop;
  const Messages messages;  // To the observer.
  ThreadPool threads;
  std::optional<Database> database;  // Always there, once it is open.
  Checkpoint checkpoint;
  std::vector<ImageRecord> all_images;
  std::vector<ImageRecord> images;             // Those with features,
  std::vector<ImageFingerprint> fingerprints;  // and of which.
  std::vector<ImagePair> listed_pairs;         // Of match_list_path.
  std::vector<ImageId> query_images;           // Of image_list_path; ascending.

 private:
  void Open();
  void WarnOfFewThreads() const;
  void WarnOfFewImages() const;
};

}  // namespace colmap_graphmatch
