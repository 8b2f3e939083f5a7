#pragma once

#include <cstddef>
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
  struct Statistics {
    double seconds = 0;            // CPU time of the fits, summed over threads.
    std::size_t num_screened = 0;  // Pairs,
    std::size_t num_settled = 0;   // and those of them that COLMAP did not get.
  };

  // colmap must outlive it.
  ScreenedVerifier(const GeometryOptions& options, CamerasOfImages cameras, ColmapVerifier& colmap);

  bool NeedsPoints() const override { return true; }
  ShardOutcome Verify(const std::vector<PairToVerify>& pairs,
                      const std::function<bool()>& should_stop) override;
  TwoViewConfiguration ConfigurationOfUnmatched() const override {
    return colmap_.ConfigurationOfUnmatched();
  }
  std::string AdviceOnFailure() const override { return colmap_.AdviceOnFailure(); }

  // Of all calls of Verify so far.
  Statistics SoFar() const;

 private:
  GeometryOptions options_;
  CamerasOfImages cameras_;
  ColmapVerifier& colmap_;
  mutable std::mutex mutex_;
  Statistics statistics_;
};

}  // namespace colmap_graphmatch
