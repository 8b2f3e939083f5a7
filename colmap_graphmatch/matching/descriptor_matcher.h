#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/matching/options.h"
#include "colmap_graphmatch/matching/top_two.h"

namespace colmap_graphmatch {

// Exact descriptor matching under COLMAP's rule (FindBestMatchesBruteForce in
// src/colmap/feature/sift.cc): the angle of two descriptors is acos(product / 512^2), in single
// precision; a descriptor of the first image and its nearest of the second match if their angle is
// at most max_distance and less than max_ratio times the angle to the second nearest. Of several
// that are equally near, the first is the nearest. The result depends on the descriptors and the
// options alone.
//
// Not thread-safe: each thread has its own, which keeps its memory from call to call.
class DescriptorMatcher {
 public:
  explicit DescriptorMatcher(const DescriptorMatchingOptions& options);

  // By ascending feature1. Either image may have no descriptors. distinctness: of every match how
  // much nearer it is than the second nearest of the second image, from 0 (just as near) to 1;
  // may be null.
  FeatureMatches Match(const DescriptorView& image1, const DescriptorView& image2,
                       std::vector<float>* distinctness = nullptr);

 private:
  bool Passes(std::int32_t best, std::int32_t second) const;

  DescriptorMatchingOptions options_;
  float max_ratio_;
  float max_distance_;
  std::int32_t min_product_;  // A smaller one is farther than max_distance for sure.
  TopTwoBuffers buffers_;
  TopTwo top_two_;
};

}  // namespace colmap_graphmatch
