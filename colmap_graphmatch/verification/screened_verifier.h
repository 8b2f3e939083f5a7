#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "colmap_graphmatch/verification/colmap_verifier.h"
#include "colmap_graphmatch/verification/geometry_options.h"
#include "colmap_graphmatch/verification/geometry_verifier.h"
#include "colmap_graphmatch/verification/in_process.h"

namespace colmap_graphmatch {

// COLMAP's verdict in a part of its time: a fast robust fit (geometry/two_view.h) goes first. A
// pair of which it cannot make an edge is settled: it gets the rows of a pair that failed. Of
// others COLMAP gets the matches near the best models and few trials, which is all it needs then.
// What the fit cannot judge goes to COLMAP whole. What a pair gets depends on the pair alone.
class ScreenedVerifier : public GeometryVerifier {
 public:
  // colmap must outlive it.
  ScreenedVerifier(const GeometryOptions& options, CamerasOfImages cameras, ColmapVerifier& colmap);

  bool NeedsPoints() const override { return true; }
  ShardOutcome Verify(const std::vector<PairToVerify>& pairs,
                      const std::function<bool()>& should_stop) override;
  TwoViewConfiguration ConfigurationOfUnmatched() const override {
    return colmap_.ConfigurationOfUnmatched();
  }
  std::string AdviceOnFailure() const override { return colmap_.AdviceOnFailure(); }
  // COLMAP has less to do for each. (With larger ones it would start less often, and in small
  // batches many cores would have nothing to do.)
  std::size_t UsualSizeOfShards() const override { return 2; }

  // Of all calls of Verify so far.
  FitStatistics SoFar() const;

 private:
  GeometryOptions options_;
  CamerasOfImages cameras_;
  ColmapVerifier& colmap_;
  mutable std::mutex mutex_;
  FitStatistics statistics_;
};

}  // namespace colmap_graphmatch
