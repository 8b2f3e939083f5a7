#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// SIFT descriptors of one image as COLMAP stores them: num_rows x 128, row-major, each entry
// round(512 x) clipped to 255 for an entry x of the unit-length descriptor.
struct Descriptors {
  std::size_t num_rows = 0;
  std::vector<std::uint8_t> data;

  const std::uint8_t* Row(std::size_t row) const { return data.data() + row * kDescriptorDim; }

  // The given rows, one after the other.
  std::vector<std::uint8_t> CopyRows(const std::vector<std::size_t>& rows) const;
};

// Keypoints of one image as COLMAP stores them: num_rows x num_cols, row-major. num_cols is 2 (x,
// y), 4 (x, y, scale, orientation) or 6 (x, y, a11, a12, a21, a22: an affine frame).
struct Keypoints {
  std::size_t num_rows = 0;
  std::size_t num_cols = 0;
  std::vector<float> data;

  // In pixels; 0 where the keypoints have no scale (num_cols 2). COLMAP's
  // FeatureKeypoint::ComputeScale (src/colmap/feature/types.cc).
  float Scale(std::size_t row) const;

  // Of the first `num` rows; 0 where there are fewer.
  std::vector<float> Scales(std::size_t num) const;
};

// An image and what tells whether its features are still the same.
struct ImageFingerprint {
  ImageId id = 0;
  std::int64_t features = 0;
};

}  // namespace colmap_graphmatch
