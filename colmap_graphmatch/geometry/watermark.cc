#include "colmap_graphmatch/geometry/watermark.h"

#include <algorithm>
#include <cmath>

namespace colmap_graphmatch {
namespace {

bool IsInBorder(const Camera& camera, double x, double y) {
  const auto width = static_cast<double>(camera.width);
  const auto height = static_cast<double>(camera.height);
  const double border = kWatermarkBorder * std::hypot(width, height);
  return !(x >= border && x <= width - border && y >= border && y <= height - border);
}

bool HasSize(const Camera& camera) { return camera.width > 0 && camera.height > 0; }

struct Shift {
  double x = 0;
  double y = 0;
};

}  // namespace

bool IsWatermark(const Camera& camera1, const Camera& camera2,
                 const std::vector<PointPair>& matches, const std::vector<std::size_t>& inliers,
                 double max_error) {
  if (inliers.empty() || !HasSize(camera1) || !HasSize(camera2)) return false;
  const double num_needed = kMinWatermarkInliers * static_cast<double>(inliers.size());
  const auto num_in_border = std::count_if(inliers.begin(), inliers.end(), [&](std::size_t i) {
    return IsInBorder(camera1, matches[i].x1, matches[i].y1) &&
           IsInBorder(camera2, matches[i].x2, matches[i].y2);
  });
  if (static_cast<double>(num_in_border) < num_needed) return false;

  std::vector<Shift> shifts;
  shifts.reserve(inliers.size());
  for (const std::size_t i : inliers) {
    shifts.push_back({matches[i].x2 - matches[i].x1, matches[i].y2 - matches[i].y1});
  }
  // How many inliers a shift explains; their mean.
  const auto count = [&](const Shift& shift, Shift* mean) {
    std::size_t num = 0;
    Shift sum;
    for (const Shift& other : shifts) {
      const double dx = other.x - shift.x;
      const double dy = other.y - shift.y;
      if (!(dx * dx + dy * dy <= max_error * max_error)) continue;
      ++num;
      sum.x += other.x;
      sum.y += other.y;
    }
    *mean = {sum.x / static_cast<double>(num), sum.y / static_cast<double>(num)};
    return static_cast<double>(num);
  };
  // If a shift explains most inliers, most of these are near it.
  constexpr std::size_t kMaxTries = 50;
  const std::size_t step = (shifts.size() + kMaxTries - 1) / kMaxTries;
  for (std::size_t i = 0; i < shifts.size(); i += step) {
    Shift shift = shifts[i];
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds; ++round) {
      Shift mean;
      if (count(shift, &mean) >= num_needed) return true;
      shift = mean;
    }
  }
  return false;
}

}  // namespace colmap_graphmatch
