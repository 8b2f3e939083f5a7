#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// A pair of corresponding features, by their rows in the two images; laid out as COLMAP stores it.
struct FeatureMatch {
  std::uint32_t feature1 = 0;
  std::uint32_t feature2 = 0;

  friend bool operator==(const FeatureMatch& a, const FeatureMatch& b) {
    return a.feature1 == b.feature1 && a.feature2 == b.feature2;
  }
};
static_assert(sizeof(FeatureMatch) == 2 * sizeof(std::uint32_t));

using FeatureMatches = std::vector<FeatureMatch>;

// Where the features of a match are, in pixels (or in any other plane) of the two images.
struct PointPair {
  double x1 = 0;
  double y1 = 0;
  double x2 = 0;
  double y2 = 0;
};

// Reads the inlier matches of a pair, feature1 being that of the smaller image id. What it returns
// stays valid until it is called again.
using InlierReader = std::function<const FeatureMatches&()>;

// TwoViewGeometry::ConfigurationType of COLMAP (src/colmap/scene/two_view_geometry.h), with its
// numbers.
enum class TwoViewConfiguration : std::uint8_t {
  kUndefined = 0,
  kDegenerate = 1,  // Too few inliers.
  kCalibrated = 2,
  kUncalibrated = 3,
  kPlanar = 4,
  kPanoramic = 5,
  kPlanarOrPanoramic = 6,
  kWatermark = 7,
  kMultiple = 8,  // Several motions.
};
inline constexpr int kMaxTwoViewConfiguration = 8;

// Row-major.
using Matrix3 = std::array<double, 9>;

// x2 ~ R x1 + t, from the first image's camera to the second's.
struct RelativePose {
  std::array<double, 4> rotation = {1, 0, 0, 0};  // A quaternion: w, x, y, z.
  std::array<double, 3> translation = {0, 0, 0};
};

// What geometric verification finds about a pair of images; the first is the one of the smaller id.
// What it did not find, or what it was not asked for, is not set.
struct TwoViewGeometry {
  TwoViewConfiguration configuration = TwoViewConfiguration::kUndefined;
  FeatureMatches inliers;
  std::optional<Matrix3> F;  // x2' F x1 = 0, in pixels.
  std::optional<Matrix3> E;  // The same for rays of calibrated cameras.
  std::optional<Matrix3> H;  // x2 ~ H x1, in pixels.
  std::optional<RelativePose> pose;
  // Cameras that COLMAP 4.2 estimated with it, as COLMAP stores them.
  std::array<std::optional<std::vector<std::uint8_t>>, 2> cameras;
};

// All that a database keeps of a tested pair.
struct PairGeometry {
  ImagePair pair;
  FeatureMatches matches;  // Of descriptors.
  // Matches that are not kept, since there were too few to be verified.
  std::size_t num_dropped_matches = 0;
  TwoViewGeometry geometry;
};

// True if COLMAP counts such a pair as an edge of the matching graph: at least one inlier, and as
// many as asked for, and neither undefined, degenerate nor a watermark. configuration: its number,
// which later versions of COLMAP may add to.
bool IsEdge(std::size_t num_inliers, int configuration, std::size_t min_num_inliers);

}  // namespace colmap_graphmatch
