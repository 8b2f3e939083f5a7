#include "colmap_graphmatch/geometry/configuration.h"

#include <algorithm>

namespace colmap_graphmatch {
namespace {

// COLMAP divides, also by zero: anything is then more than any part of nothing, and nothing is not
// more than a part of nothing.
bool IsMoreThan(std::size_t num, double ratio, std::size_t of) {
  return static_cast<double>(num) / static_cast<double>(of) > ratio;
}

}  // namespace

ConfigurationChoice ChooseCalibrated(std::size_t num_fundamental, std::size_t num_essential,
                                     std::size_t num_homography, std::size_t min_num_inliers) {
  if (std::max({num_fundamental, num_essential, num_homography}) < min_num_inliers) return {};
  ConfigurationChoice choice;
  std::size_t num_inliers = 0;
  const auto choose_homography_if = [&](std::size_t more_than_part_of) {
    if (!IsMoreThan(num_homography, kMaxHomographyRatio, more_than_part_of)) return;
    choice.configuration = TwoViewConfiguration::kPlanarOrPanoramic;
    if (num_homography > num_inliers) choice.inliers = InlierSource::kHomography;
  };
  if (num_essential >= min_num_inliers && num_essential > 0 &&
      IsMoreThan(num_essential, kMinEssentialRatio, num_fundamental)) {
    choice = {TwoViewConfiguration::kCalibrated, num_essential >= num_fundamental
                                                     ? InlierSource::kEssential
                                                     : InlierSource::kFundamental};
    num_inliers = std::max(num_essential, num_fundamental);
    choose_homography_if(num_essential);
  } else if (num_fundamental >= min_num_inliers && num_fundamental > 0) {
    choice = {TwoViewConfiguration::kUncalibrated, InlierSource::kFundamental};
    num_inliers = num_fundamental;
    choose_homography_if(num_fundamental);
  } else if (num_homography >= min_num_inliers && num_homography > 0) {
    choice = {TwoViewConfiguration::kPlanarOrPanoramic, InlierSource::kHomography};
  }
  return choice;
}

ConfigurationChoice ChooseUncalibrated(std::size_t num_fundamental, std::size_t num_homography,
                                       std::size_t min_num_inliers) {
  const std::size_t greatest = std::max(num_fundamental, num_homography);
  if (greatest < min_num_inliers || greatest == 0) return {};
  if (!IsMoreThan(num_homography, kMaxHomographyRatio, num_fundamental)) {
    return {TwoViewConfiguration::kUncalibrated, InlierSource::kFundamental};
  }
  return {TwoViewConfiguration::kPlanarOrPanoramic, num_homography >= num_fundamental
                                                        ? InlierSource::kHomography
                                                        : InlierSource::kFundamental};
}

}  // namespace colmap_graphmatch
