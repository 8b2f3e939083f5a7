#pragma once

// As in the code that is tested and measured.
#define HWY_WANT_AVX3_DL
#include <hwy/targets.h>

#include <cstdint>
#include <string>
#include <vector>

#include "colmap_graphmatch/matching/top_two.h"
#include "colmap_graphmatch/matching/top_two_testing.h"

namespace colmap_graphmatch {

// An instruction set that exact matching can be told to use.
struct MatchingTarget {
  std::int64_t target = 0;   // Of Highway; 0: the best of this processor.
  bool dot_products = true;  // Those of bytes, where AVX2 or NEON have them.

  void Use() const {
    hwy::SetSupportedTargetsForTest(target);
    AllowDotProductsForTest(dot_products);
  }

  std::string Name() const {
    Use();
    std::string name = TopTwoTarget();
    MatchingTarget().Use();
    return name;
  }
};

// Every one of this processor that the code was compiled for.
inline std::vector<MatchingTarget> MatchingTargets() {
  std::vector<MatchingTarget> targets;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    targets.push_back({target, true});
    const MatchingTarget without{target, false};
    if (without.Name() != targets.back().Name()) targets.push_back(without);
  }
  return targets;
}

}  // namespace colmap_graphmatch
