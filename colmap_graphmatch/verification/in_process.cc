#include "colmap_graphmatch/verification/in_process.h"

#include <algorithm>
#include <utility>

#include "colmap_graphmatch/geometry/camera.h"

namespace colmap_graphmatch {

TwoViewOptions TwoViewOptionsOf(const GeometryOptions& options) {
  TwoViewOptions two_view;
  const auto set = [](const auto& value, auto* field) {
    if (value) *field = static_cast<std::decay_t<decltype(*field)>>(*value);
  };
  two_view.min_num_inliers = static_cast<std::size_t>(std::max(1, options.min_num_inliers));
  set(options.max_error, &two_view.max_error);
  set(options.confidence, &two_view.confidence);
  set(options.max_num_trials, &two_view.max_num_trials);
  set(options.min_inlier_ratio, &two_view.min_inlier_ratio);
  set(options.detect_watermark, &two_view.detect_watermark);
  set(options.compute_relative_pose, &two_view.compute_relative_pose);
  two_view.watermark_max_error = options.watermark_detection_max_error;
  two_view.min_num_trials = std::min(two_view.min_num_trials, two_view.max_num_trials);
  return two_view;
}

bool NeedsColmap(const GeometryOptions& options) {
  return options.guided_matching.value_or(false) || options.multiple_models.value_or(false) ||
         options.planar_scene.value_or(false) || options.filter_stationary_matches.value_or(false);
}

CamerasOfImages::CamerasOfImages(const std::vector<ImageRecord>& images,
                                 std::map<CameraId, Camera> cameras)
    : cameras_(std::move(cameras)) {
  for (const ImageRecord& image : images) camera_of_.emplace(image.id, image.camera_id);
}

const Camera* CamerasOfImages::Of(ImageId image) const {
  const auto camera = cameras_.find(camera_of_.at(image));
  return camera == cameras_.end() ? nullptr : &camera->second;
}

bool CamerasOfImages::CanJudge(const ImagePair& pair) const {
  if (WhyUnusable(pair.id1) || WhyUnusable(pair.id2)) return false;
  const Camera* first = Of(pair.id1);
  const Camera* second = Of(pair.id2);
  // Later versions of COLMAP fit rays, not pixels, where lines in the image are bent.
  const auto is_straight = [](const Camera& camera) {
    return FindCameraModel(camera.model_id)->projection == Projection::kPerspective;
  };
  return (is_straight(*first) && is_straight(*second)) ||
         (first->has_prior_focal_length && second->has_prior_focal_length);
}

std::optional<std::string> CamerasOfImages::WhyUnusable(ImageId image) const {
  const Camera* camera = Of(image);
  return camera == nullptr ? "it is missing" : WhyNotUsable(*camera);
}

}  // namespace colmap_graphmatch
