#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/matching/descriptor_matcher.h"
#include "colmap_graphmatch/matching/top_two.h"

// The plain way to do what colmap_graphmatch/matching does fast, for tests to compare with: one
// product at a time, as COLMAP's FindBestMatchesBruteForce (src/colmap/feature/sift.cc) does it.

namespace colmap_graphmatch {

inline std::int32_t ReferenceProduct(const DescriptorView& a, std::size_t i,
                                     const DescriptorView& b, std::size_t j) {
  std::int32_t product = 0;
  for (std::size_t d = 0; d < 128; ++d) product += a.data[i * 128 + d] * b.data[j * 128 + d];
  return product;
}

struct ReferenceBest {
  int index = -1;
  std::int32_t best = 0;
  std::int32_t second = 0;
};

inline ReferenceBest ReferenceBestOf(const DescriptorView& a, std::size_t i,
                                     const DescriptorView& b) {
  ReferenceBest result;
  for (std::size_t j = 0; j < b.num; ++j) {
    const std::int32_t product = ReferenceProduct(a, i, b, j);
    if (product > result.best) {
      result.index = static_cast<int>(j);
      result.second = result.best;
      result.best = product;
    } else if (product > result.second) {
      result.second = product;
    }
  }
  return result;
}

inline std::vector<int> ReferenceOneWay(const DescriptorMatchingOptions& options,
                                        const DescriptorView& a, const DescriptorView& b) {
  const auto angle = [](std::int32_t product) {
    return std::acos(std::min(1.0F / (512.0F * 512.0F) * static_cast<float>(product), 1.0F));
  };
  std::vector<int> matches(a.num, -1);
  for (std::size_t i = 0; i < a.num; ++i) {
    const ReferenceBest found = ReferenceBestOf(a, i, b);
    if (found.index == -1) continue;
    if (angle(found.best) > static_cast<float>(options.max_distance)) continue;
    if (angle(found.best) >= static_cast<float>(options.max_ratio) * angle(found.second)) continue;
    matches[i] = found.index;
  }
  return matches;
}

inline std::vector<FeatureMatch> ReferenceMatch(const DescriptorMatchingOptions& options,
                                                DescriptorView a, DescriptorView b) {
  a.num = std::min(a.num, static_cast<std::size_t>(options.max_num_matches));
  b.num = std::min(b.num, static_cast<std::size_t>(options.max_num_matches));
  const std::vector<int> forward = ReferenceOneWay(options, a, b);
  const std::vector<int> backward = ReferenceOneWay(options, b, a);
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < a.num; ++i) {
    if (forward[i] == -1) continue;
    const auto j = static_cast<std::size_t>(forward[i]);
    if (options.cross_check && backward[j] != static_cast<int>(i)) continue;
    matches.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
  }
  return matches;
}

}  // namespace colmap_graphmatch
