#pragma once

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "colmap_graphmatch/pipeline/result.h"
#include "colmap_graphmatch/report/graph_analysis.h"

namespace colmap_graphmatch {

// A run's images by their places in RunDetails::images, as reports and exports count them.
class ImageIndex {
 public:
  explicit ImageIndex(const std::vector<ImageRecord>& images) {
    for (std::size_t i = 0; i < images.size(); ++i) places_.emplace(images[i].id, i);
  }

  std::size_t Of(ImageId id) const { return places_.at(id); }

 private:
  std::unordered_map<ImageId, std::size_t> places_;
};

// Ascending.
inline std::vector<GraphEdge> EdgesOf(const RunDetails& details, const ImageIndex& index) {
  std::vector<GraphEdge> edges;
  for (const VerifiedPair& verified : details.tested) {
    if (verified.outcome != PairOutcome::kEdge) continue;
    edges.push_back(
        {index.Of(verified.pair.id1), index.Of(verified.pair.id2), verified.num_inliers});
  }
  return edges;
}

}  // namespace colmap_graphmatch
