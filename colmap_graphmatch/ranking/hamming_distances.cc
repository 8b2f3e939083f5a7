#include "colmap_graphmatch/ranking/hamming_distances.h"

// Highway compiles this file once for each instruction set and picks one when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "colmap_graphmatch/ranking/hamming_distances.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace colmap_graphmatch {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void HammingDistancesOnTarget(const Signs& query, const std::uint64_t* HWY_RESTRICT low,
                              const std::uint64_t* HWY_RESTRICT high, std::size_t num,
                              std::uint64_t* HWY_RESTRICT distances) {
  const hn::ScalableTag<std::uint64_t> tag;
  const std::size_t lanes = hn::Lanes(tag);
  const auto query_low = hn::Set(tag, query[0]);
  const auto query_high = hn::Set(tag, query[1]);
  std::size_t i = 0;
  for (; i + lanes <= num; i += lanes) {
    const auto differing_low = hn::Xor(hn::LoadU(tag, low + i), query_low);
    const auto differing_high = hn::Xor(hn::LoadU(tag, high + i), query_high);
    hn::StoreU(hn::Add(hn::PopulationCount(differing_low), hn::PopulationCount(differing_high)),
               tag, distances + i);
  }
  for (; i < num; ++i) {
    distances[i] = hwy::PopCount(low[i] ^ query[0]) + hwy::PopCount(high[i] ^ query[1]);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace colmap_graphmatch
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colmap_graphmatch {

HWY_EXPORT(HammingDistancesOnTarget);

void HammingDistances(const Signs& query, const std::uint64_t* low, const std::uint64_t* high,
                      std::size_t num, std::uint64_t* distances) {
  HWY_DYNAMIC_DISPATCH(HammingDistancesOnTarget)(query, low, high, num, distances);
}

}  // namespace colmap_graphmatch
#endif
