#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/verification/replay_verifier.h"

namespace colmap_graphmatch {

// A matching graph that is finished, to be replayed.
struct FinishedGraph {
  std::unordered_map<ImagePair, ReplayedPair> pairs;
  std::size_t num_edges = 0;

  // Of a database: reads the inlier matches of a pair. Empty for a list, which has none.
  std::function<FeatureMatches(const ImagePair&)> read_inliers;

  // Lines or pairs of images that the database does not have, or that have no features there.
  std::size_t num_skipped = 0;
  std::string first_skipped;
};

// Reads the pairs from a matched COLMAP database, whose images are found by their names, or from a
// text file (docs/formats.md): lines of two image names, the number of inliers, COLMAP's
// configuration (2 if it is left out) and the number of matches (the inliers, if it is left out),
// separated by tabs. A pair is an edge by IsEdge; it counts as verified with at least
// min_num_inliers matches.
//
// Throws FileError (the text: what, in which line), DatabaseError.
FinishedGraph ReadFinishedGraph(const std::filesystem::path& path,
                                const std::vector<ImageRecord>& images, int min_num_inliers,
                                const sqlite::LockPatience& patience);

}  // namespace colmap_graphmatch
