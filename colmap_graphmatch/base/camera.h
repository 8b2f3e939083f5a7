#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace colmap_graphmatch {

// COLMAP's camera_t.
using CameraId = std::uint32_t;

// A camera model of COLMAP (src/colmap/sensor/models.h), by its number in databases.
struct CameraModel {
  int id = -1;
  std::string_view name;
  int num_params = 0;
};

// Null for a model that no COLMAP up to 4.2 has.
const CameraModel* FindCameraModel(int id);
const CameraModel* FindCameraModel(std::string_view name);

// A camera as a database has it; nothing says yet that its parameters make sense.
struct Camera {
  CameraId id = 0;
  int model_id = -1;
  int width = 0;  // In pixels.
  int height = 0;
  std::vector<double> params;
  bool has_prior_focal_length = false;  // From EXIF, or given by the user.
};

// What no COLMAP could work with, e.g. "has 3 parameters, where RADIAL has 5"; empty if there is
// nothing.
std::string ProblemOf(const Camera& camera);

}  // namespace colmap_graphmatch
