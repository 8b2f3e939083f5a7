#pragma once

#include <cstddef>
#include <filesystem>

#include "colmap_graphmatch/pipeline/result.h"

namespace colmap_graphmatch {

// What a run found, for other programs (docs/formats.md). The functions throw FileError if the file
// cannot be written; then what was there before is still there.

// What of the names of images such a list cannot hold as it should.
struct PairListNames {
  bool any_spaces = false;       // Neither of those programs can read such lines.
  std::size_t num_left_out = 0;  // Pairs with a line end or a tab in a name.
};

// Two names a line, as COLMAP's matches_importer and hloc read them: the edges, those with the most
// inliers first, or the candidates, nearest first. A space between them, or a tab if
// one of them has spaces.
PairListNames WritePairList(const std::filesystem::path& path, const RunDetails& details);
PairListNames WritePairList(const std::filesystem::path& path, const CandidateList& candidates);

// The matching graph: the images with their ids, names and components, the edges with their numbers
// of inliers. GraphML, or the language of Graphviz if the path ends in .dot or .gv.
void WriteGraph(const std::filesystem::path& path, const RunDetails& details);

}  // namespace colmap_graphmatch
