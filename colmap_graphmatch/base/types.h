#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <tuple>

namespace colmap_graphmatch {

// COLMAP's image_t. Valid ids are 1 .. kMaxNumImages - 1.
using ImageId = std::uint32_t;

// COLMAP's camera_t.
using CameraId = std::uint32_t;

// COLMAP's image_pair_t: the key of the tables `matches` and `two_view_geometries`.
using PairId = std::uint64_t;

// COLMAP's Database::kMaxNumImages (src/colmap/scene/database.h), the base of the pair_id codec.
inline constexpr PairId kMaxNumImages = 2147483647;

// The number of an image among those that a run works on, 0 .. N - 1: in rankings and in the
// matching graph.
using Vertex = std::uint32_t;

// The length of a SIFT descriptor.
inline constexpr int kDescriptorDim = 128;

// An image of a COLMAP database.
struct ImageRecord {
  ImageId id = 0;
  std::string name;
  std::size_t num_features = 0;  // 0 also for an image whose features were never extracted.
  CameraId camera_id = 0;
};

// An unordered pair of two different images, kept with the smaller id first, as COLMAP stores it.
struct ImagePair {
  ImagePair() = default;
  ImagePair(ImageId a, ImageId b) : id1(std::min(a, b)), id2(std::max(a, b)) {}

  ImageId id1 = 0;
  ImageId id2 = 0;

  friend bool operator==(const ImagePair& a, const ImagePair& b) {
    return a.id1 == b.id1 && a.id2 == b.id2;
  }
  friend bool operator!=(const ImagePair& a, const ImagePair& b) { return !(a == b); }
  friend bool operator<(const ImagePair& a, const ImagePair& b) {
    return std::tie(a.id1, a.id2) < std::tie(b.id1, b.id2);
  }
};

// pair_id = 2147483647 * min(id) + max(id), the same in every version of COLMAP.
inline PairId EncodePair(const ImagePair& pair) { return kMaxNumImages * pair.id1 + pair.id2; }

inline ImagePair DecodePair(PairId pair_id) {
  return ImagePair(static_cast<ImageId>(pair_id / kMaxNumImages),
                   static_cast<ImageId>(pair_id % kMaxNumImages));
}

}  // namespace colmap_graphmatch

template <>
struct std::hash<colmap_graphmatch::ImagePair> {
  std::size_t operator()(const colmap_graphmatch::ImagePair& pair) const noexcept {
    return std::hash<colmap_graphmatch::PairId>()(colmap_graphmatch::EncodePair(pair) *
                                                  0x9E3779B97F4A7C15ull);
  }
};
