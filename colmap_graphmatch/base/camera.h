#pragma once

#include <vector>

#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// A camera as a database has it; nothing says yet that its parameters make sense
// (geometry/camera.h has the models).
struct Camera {
  CameraId id = 0;
  int model_id = -1;
  int width = 0;  // In pixels.
  int height = 0;
  std::vector<double> params;
  bool has_prior_focal_length = false;  // From EXIF, or given by the user.
};

}  // namespace colmap_graphmatch
