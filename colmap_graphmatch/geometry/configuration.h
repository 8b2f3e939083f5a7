#pragma once

#include <cstddef>

#include "colmap_graphmatch/base/two_view_geometry.h"

namespace colmap_graphmatch {

enum class InlierSource { kNone, kFundamental, kEssential, kHomography };

struct ConfigurationChoice {
  TwoViewConfiguration configuration = TwoViewConfiguration::kDegenerate;
  InlierSource inliers = InlierSource::kNone;  // The model whose inliers are stored.
};

// COLMAP's ratios (src/colmap/estimators/two_view_geometry.h): E must fit more than this part of
// F's inliers for the focal lengths to be believed, and a homography that fits more than this part
// of those of the other model makes the pair planar or panoramic.
inline constexpr double kMinEssentialRatio = 0.95;
inline constexpr double kMaxHomographyRatio = 0.8;

// The configuration by the numbers of inliers (0: no model was found), where both cameras have a
// prior focal length, and where one has none. Watermarks come after this.
ConfigurationChoice ChooseCalibrated(std::size_t num_fundamental, std::size_t num_essential,
                                     std::size_t num_homography, std::size_t min_num_inliers);
ConfigurationChoice ChooseUncalibrated(std::size_t num_fundamental, std::size_t num_homography,
                                       std::size_t min_num_inliers);

}  // namespace colmap_graphmatch
