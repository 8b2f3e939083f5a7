#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/ranking/list_ranking.h"

namespace colmap_graphmatch {

struct RankedLists {
  std::unique_ptr<ListRanking> ranking;  // Vertices: the images, in their order.
  std::string checksum;                  // Of the lines.
  std::size_t num_skipped = 0;           // Lines of images that are not among the given ones.
  std::string first_skipped;
};

// Reads ranked lists that another program made, e.g. `colmap vocab_tree_retriever`: lines of an
// image, another one and a score, separated by tabs; greater scores are nearer. images: those with
// features. Throws FileError.
RankedLists ReadRankedLists(const std::filesystem::path& path,
                            const std::vector<ImageRecord>& images,
                            const StopRequest* stop = nullptr);

}  // namespace colmap_graphmatch
