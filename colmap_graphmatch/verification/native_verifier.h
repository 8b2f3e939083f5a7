#pragma once

#include <functional>
#include <mutex>
#include <vector>

#include "colmap_graphmatch/verification/geometry_options.h"
#include "colmap_graphmatch/verification/geometry_verifier.h"
#include "colmap_graphmatch/verification/in_process.h"

namespace colmap_graphmatch {

// The verdict of geometry/two_view.h under COLMAP's rules, without COLMAP. A camera that makes no
// sense counts as one whose focal length is not known.
class NativeVerifier : public GeometryVerifier {
 public:
  // unmatched: of pairs that fail.
  NativeVerifier(const GeometryOptions& options, CamerasOfImages cameras,
                 TwoViewConfiguration unmatched);

  bool NeedsPoints() const override { return true; }
  ShardOutcome Verify(const std::vector<PairToVerify>& pairs,
                      const std::function<bool()>& should_stop) override;
  TwoViewConfiguration ConfigurationOfUnmatched() const override { return unmatched_; }

  // Of all calls of Verify so far.
  FitStatistics SoFar() const;

 private:
  PairGeometry VerifyPair(const PairToVerify& pair) const;

  TwoViewOptions options_;
  CamerasOfImages cameras_;
  TwoViewConfiguration unmatched_;
  mutable std::mutex mutex_;
  FitStatistics statistics_;
};

}  // namespace colmap_graphmatch
