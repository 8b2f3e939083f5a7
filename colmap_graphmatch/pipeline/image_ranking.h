#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/pipeline/image_vectors.h"
#include "colmap_graphmatch/pipeline/observer.h"
#include "colmap_graphmatch/pipeline/run_state.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// For messages, e.g. "Fisher vectors".
const char* NameOfVectors(ImageVectorOptions::Descriptor descriptor);

struct ImageRankingOptions {
  ImageVectorOptions vectors;
  RankingOptions ranking;

  // Writes the vectors that are made to this file (encoding/numpy_file.h), unless it is empty.
  std::filesystem::path export_path;

  // Takes the ranked lists from this file (see ranked_lists.h) instead of making vectors, unless it
  // is empty.
  std::filesystem::path ranking_path;

  // Throws OptionsError.
  void Check() const;
};

struct ImageRankingSeconds {
  double mixture = 0;
  double vectors = 0;
  double ranking = 0;

  double Sum() const { return mixture + vectors + ranking; }
};

struct RankedImages {
  std::vector<ImageRecord> images;   // Those that are ranked, ascending by id,
  std::unique_ptr<Ranking> ranking;  // and their ranking: a vertex each.
};

// From the features to ranked lists: the pre-processing of the paper. images: all with features,
// and their fingerprints. known: the pairs that are in the database, of which a warning may speak.
// What an earlier run kept is used, and kept for the next.
RankedImages RankImages(const ImageRankingOptions& options, Database& database,
                        const std::vector<ImageRecord>& images,
                        const std::vector<ImageFingerprint>& fingerprints,
                        const std::vector<VerifiedPair>& known, RunState& state,
                        ThreadPool& threads, const StopRequest& stop, PipelineObserver& observer,
                        ImageRankingSeconds* seconds);

}  // namespace colmap_graphmatch
