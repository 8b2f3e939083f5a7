#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/messages.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/verified_pair.h"
#include "colmap_graphmatch/base/visual_words.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/ranking/ranking.h"
#include "colmap_graphmatch/vectors/checkpoint.h"
#include "colmap_graphmatch/vectors/options.h"
#include "colmap_graphmatch/vectors/ranking_seconds.h"
#include "colmap_graphmatch/vectors/vector_model.h"

namespace colmap_graphmatch {

// The images that have a vector, ascending by id, and a row of dim floats for each; for kAsmk
// instead of it the visual words of each.
struct ImageVectors {
  std::vector<ImageRecord> images;
  std::size_t dim = 0;
  std::vector<float> rows;
  std::vector<VisualWords> words;
};

struct RankedImages {
  std::vector<ImageRecord> images;   // Those that are ranked, ascending by id,
  std::unique_ptr<Ranking> ranking;  // and their ranking: a vertex each.
};

// From the features to ranked lists: the pre-processing of the paper. Learn, Encode, Rank: in this
// order, each once. What an earlier run kept is used, and kept for the next.
class ImageRanker {
 public:
  // images: all with features, and their fingerprints. seed: of everything random. All that is
  // passed by reference must outlive it.
  ImageRanker(const ImageRankingOptions& options, std::uint64_t seed, Database& database,
              const std::vector<ImageRecord>& images,
              const std::vector<ImageFingerprint>& fingerprints, Checkpoint& checkpoint,
              ThreadPool& threads, const StopRequest& stop, const Messages& messages);

  // What images are described with. known: the pairs that are in the database, of which a warning
  // may speak. Nothing where vectors or ranked lists are given.
  VectorModel Learn(const std::vector<VerifiedPair>& known);

  // Reads the vectors where they are given; none where ranked lists are.
  ImageVectors Encode(const VectorModel& model);

  // Reads the ranked lists where they are given, whatever the vectors.
  RankedImages Rank(ImageVectors vectors);

  // What the steps took.
  const ImageRankingSeconds& Seconds() const { return seconds_; }

 private:
  bool AreListsGiven() const { return !options_.ranking_path.empty(); }
  bool AreVectorsGiven() const;
  bool UsesWords() const;

  void SelectKept(const std::vector<VerifiedPair>& known);
  VectorModel FindModel();
  std::vector<float> FindVectors(const VectorModel& model);
  std::vector<VisualWords> FindWords(const VectorModel& model);
  // Calls make(records, places) for blocks of the images that were not kept.
  using MakeBlock =
      std::function<void(const std::vector<ImageRecord>&, const std::vector<std::size_t>&)>;
  void ForEachBlockOfMissing(const std::vector<bool>& kept, const MakeBlock& make) const;
  void DescribeEncoding(const std::string& what, const std::vector<bool>& kept) const;
  ImageVectors ReadVectors();
  RankedImages ReadLists();
  void Export(const ImageVectors& vectors) const;

  const ImageRankingOptions& options_;
  std::uint64_t seed_;
  Database& database_;
  const std::vector<ImageRecord>& images_;
  const std::vector<ImageFingerprint>& fingerprints_;
  Checkpoint& checkpoint_;
  ThreadPool& threads_;
  const StopRequest& stop_;
  const Messages& messages_;
  ImageRankingSeconds seconds_;
};

}  // namespace colmap_graphmatch
