#include "colmap_graphmatch/database/features.h"

#include <algorithm>
#include <cmath>

namespace colmap_graphmatch {

float Keypoints::Scale(std::size_t row) const {
  const float* keypoint = data.data() + row * num_cols;
  switch (num_cols) {
    case 4:
      return keypoint[2];
    case 6:
      return (std::hypot(keypoint[2], keypoint[4]) + std::hypot(keypoint[3], keypoint[5])) / 2;
    default:
      return 0;
  }
}

std::vector<float> Keypoints::Scales(std::size_t num) const {
  std::vector<float> scales(num);
  for (std::size_t row = 0; row < std::min(num, num_rows); ++row) scales[row] = Scale(row);
  return scales;
}

std::vector<std::uint8_t> Descriptors::CopyRows(const std::vector<std::size_t>& rows) const {
  std::vector<std::uint8_t> copy;
  copy.reserve(rows.size() * kDescriptorDim);
  for (const std::size_t row : rows) copy.insert(copy.end(), Row(row), Row(row) + kDescriptorDim);
  return copy;
}

}  // namespace colmap_graphmatch
