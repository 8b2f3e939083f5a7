#include "colmap_graphmatch/base/camera.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace colmap_graphmatch {
namespace {

constexpr std::array<CameraModel, 18> kCameraModels = {{{0, "SIMPLE_PINHOLE", 3},
                                                        {1, "PINHOLE", 4},
                                                        {2, "SIMPLE_RADIAL", 4},
                                                        {3, "RADIAL", 5},
                                                        {4, "OPENCV", 8},
                                                        {5, "OPENCV_FISHEYE", 8},
                                                        {6, "FULL_OPENCV", 12},
                                                        {7, "FOV", 5},
                                                        {8, "SIMPLE_RADIAL_FISHEYE", 4},
                                                        {9, "RADIAL_FISHEYE", 5},
                                                        {10, "THIN_PRISM_FISHEYE", 12},
                                                        {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16},
                                                        {12, "SIMPLE_DIVISION", 4},
                                                        {13, "DIVISION", 5},
                                                        {14, "SIMPLE_FISHEYE", 3},
                                                        {15, "FISHEYE", 4},
                                                        {16, "EUCM", 6},
                                                        {17, "EQUIRECTANGULAR", 2}}};

template <typename Predicate>
const CameraModel* Find(const Predicate& predicate) {
  const auto* const model = std::find_if(kCameraModels.begin(), kCameraModels.end(), predicate);
  return model == kCameraModels.end() ? nullptr : model;
}

}  // namespace

const CameraModel* FindCameraModel(int id) {
  return Find([id](const CameraModel& model) { return model.id == id; });
}

const CameraModel* FindCameraModel(std::string_view name) {
  return Find([name](const CameraModel& model) { return model.name == name; });
}

std::string ProblemOf(const Camera& camera) {
  const CameraModel* model = FindCameraModel(camera.model_id);
  if (model == nullptr) return "has the unknown model " + std::to_string(camera.model_id);
  if (camera.params.size() != static_cast<std::size_t>(model->num_params)) {
    return "has " + std::to_string(camera.params.size()) + " parameters, where " +
           std::string(model->name) + " has " + std::to_string(model->num_params);
  }
  const bool finite = std::all_of(camera.params.begin(), camera.params.end(),
                                  [](double param) { return std::isfinite(param); });
  if (!finite) return "has a parameter that is no number";
  if (camera.width < 1 || camera.height < 1) return "has no width or height";
  return "";
}

}  // namespace colmap_graphmatch
