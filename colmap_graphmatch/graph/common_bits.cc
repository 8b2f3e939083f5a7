#include "colmap_graphmatch/graph/common_bits.h"

// Highway compiles this file once for each instruction set and picks one when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "colmap_graphmatch/graph/common_bits.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace colmap_graphmatch {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

std::size_t CountCommonBitsOnTarget(const std::uint64_t* HWY_RESTRICT a,
                                    const std::uint64_t* HWY_RESTRICT b, std::size_t num) {
  const hn::ScalableTag<std::uint64_t> tag;
  const std::size_t lanes = hn::Lanes(tag);
  auto sums = hn::Zero(tag);
  std::size_t i = 0;
  for (; i + lanes <= num; i += lanes) {
    sums =
        hn::Add(sums, hn::PopulationCount(hn::And(hn::LoadU(tag, a + i), hn::LoadU(tag, b + i))));
  }
  std::size_t count = hn::GetLane(hn::SumOfLanes(tag, sums));
  for (; i < num; ++i) count += hwy::PopCount(a[i] & b[i]);
  return count;
}

}  // namespace HWY_NAMESPACE
}  // namespace colmap_graphmatch
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colmap_graphmatch {

HWY_EXPORT(CountCommonBitsOnTarget);

std::size_t CountCommonBits(const std::uint64_t* a, const std::uint64_t* b, std::size_t num) {
  return HWY_DYNAMIC_DISPATCH(CountCommonBitsOnTarget)(a, b, num);
}

}  // namespace colmap_graphmatch
#endif
