#include "colmap_graphmatch/verification/geometry_options.h"

#include <string>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

void GeometryOptions::Check() const {
  if (min_num_inliers < 0) throw OptionsError("min_num_inliers must be at least 0.");
  const auto check = [](const std::optional<double>& value, const std::string& name,
                        bool is_share) {
    if (!value) return;
    if (is_share && !(*value >= 0 && *value <= 1)) {
      throw OptionsError(name + " must be from 0 to 1.");
    }
    if (!is_share && !(*value > 0)) throw OptionsError(name + " must be greater than 0.");
  };
  check(max_error, "max_error", false);
  check(confidence, "confidence", true);
  check(min_inlier_ratio, "min_inlier_ratio", true);
  check(watermark_detection_max_error, "watermark_detection_max_error", false);
  check(stationary_matches_max_error, "stationary_matches_max_error", false);
  if (max_num_trials && *max_num_trials < 1) {
    throw OptionsError("max_num_trials must be at least 1.");
  }
}

}  // namespace colmap_graphmatch
