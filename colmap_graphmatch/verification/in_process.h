#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/camera.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/geometry/two_view.h"
#include "colmap_graphmatch/verification/geometry_options.h"

namespace colmap_graphmatch {

// What verifiers in this process share: cameras and options for the estimator of geometry/.

// With COLMAP's defaults for what is not set.
TwoViewOptions TwoViewOptionsOf(const GeometryOptions& options);

// Of the fits of a verifier, so far.
struct FitStatistics {
  double seconds = 0;           // CPU time, summed over threads.
  std::size_t num_fitted = 0;   // Pairs,
  std::size_t num_settled = 0;  // and those of them that COLMAP did not get.
};

// Whether the options ask for what COLMAP alone has: guided matching, several motions, planar
// scenes by decree, the filter of stationary matches.
bool NeedsColmap(const GeometryOptions& options);

// The cameras of images, and which of them the estimator of geometry/ can judge.
class CamerasOfImages {
 public:
  CamerasOfImages(const std::vector<ImageRecord>& images, std::map<CameraId, Camera> cameras);

  // Of an image that was given; null if its camera is missing.
  const Camera* Of(ImageId image) const;

  // Whether the estimator judges pairs of these images as COLMAP does: both cameras have an image
  // plane and parameters that make sense, and none is a fisheye's or alike of which the focal
  // length is not known.
  bool CanJudge(const ImagePair& pair) const;

  // What is wrong with the camera of an image that was given, in words: it is missing, makes no
  // sense or has no image plane; nothing if it is in order.
  std::optional<std::string> WhyUnusable(ImageId image) const;

 private:
  std::map<ImageId, CameraId> camera_of_;
  std::map<CameraId, Camera> cameras_;
};

}  // namespace colmap_graphmatch
