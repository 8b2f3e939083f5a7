#pragma once

#include <cstddef>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/base/verified_pair.h"
#include "colmap_graphmatch/graph/exploration.h"
#include "colmap_graphmatch/pipeline/result.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// Takes down what RunDetails need while a run goes on.
class DetailsRecorder {
 public:
  // The pair that the progress reports. The curve keeps at most kMaxPoints points.
  void Add(const LoopProgress& progress, double seconds);

  // Adds the pairs that were known before the run, but for those of other images than these.
  void AddKnown(const std::vector<VerifiedPair>& known, const std::vector<ImageRecord>& images);

  static constexpr std::size_t kMaxPoints = 2000;

  // Every test of the run, or every 2nd, 4th ... and the last one of each stage and iteration.
  std::vector<DiscoveryPoint> Discovery() const;

  // Every pair that is known to be tested or to have failed, ascending.
  const std::vector<VerifiedPair>& Tested();

 private:
  std::vector<DiscoveryPoint> points_;
  DiscoveryPoint last_;
  std::size_t stride_ = 1;
  std::vector<VerifiedPair> tested_;
  bool is_sorted_ = true;
};

// For every image without an edge its max_num_candidates nearest tested images. ids: of the
// ranking's vertices, ascending; images that are not ranked have infinite distances. ranking may be
// null. images: ascending by id.
std::vector<ImageWithoutEdge> FindImagesWithoutEdge(const std::vector<ImageRecord>& images,
                                                    const std::vector<VerifiedPair>& tested,
                                                    const Ranking* ranking,
                                                    const std::vector<ImageId>& ids,
                                                    std::size_t max_num_candidates);

}  // namespace colmap_graphmatch
