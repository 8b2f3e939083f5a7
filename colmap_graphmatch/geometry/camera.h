#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "colmap_graphmatch/base/camera.h"

namespace colmap_graphmatch {

// How a model takes a point (u, v, 1) to the plane that focal lengths and principal point scale.
enum class Projection {
  kPerspective,  // u and v, plus a distortion.
  kFisheye,      // The angle to the axis in place of its tangent, plus a distortion.
  kOwnFormula,   // By a formula of the model's own, which can be inverted.
  kSpherical,    // It has no image plane: nothing here can judge it.
};

// The models of COLMAP 3.8 to 4.2 (src/colmap/sensor/models.h), with COLMAP's ids and order of
// parameters.
struct CameraModel {
  int id;
  const char* name;
  std::size_t num_focal_lengths;
  std::size_t num_params;
  Projection projection;
};

// Null if there is none.
const CameraModel* FindCameraModel(int id);
const CameraModel* FindCameraModel(std::string_view name);

// Why nothing can be said of this camera's images, in words; nothing if it is in order: a known
// model with an image plane, the right number of parameters, all finite, focal lengths above 0.
std::optional<std::string> WhyNotUsable(const Camera& camera);

// The following are for usable cameras.

double MeanFocalLength(const Camera& camera);

// On the normalised image plane: where the ray through a pixel meets z = 1. False if there is no
// such ray, or none is found.
bool ToNormalizedPlane(const Camera& camera, double x, double y, double* u, double* v);

// The pixel of a point (u, v, 1). False if it has none.
bool ToPixel(const Camera& camera, double u, double v, double* x, double* y);

// fx, fy, cx, cy.
struct PinholeParams {
  double fx, fy, cx, cy;
};
PinholeParams PinholePart(const Camera& camera);

}  // namespace colmap_graphmatch
