#include "colmap_graphmatch/matching/pair_order.h"

#include <algorithm>
#include <cstdint>

namespace colmap_graphmatch {
namespace {

// The bits of an id, each followed by a zero.
std::uint64_t Spread(std::uint64_t id) {
  id = (id | id << 16) & 0x0000FFFF0000FFFFull;
  id = (id | id << 8) & 0x00FF00FF00FF00FFull;
  id = (id | id << 4) & 0x0F0F0F0F0F0F0F0Full;
  id = (id | id << 2) & 0x3333333333333333ull;
  return (id | id << 1) & 0x5555555555555555ull;
}

std::uint64_t PlaceOnCurve(const ImagePair& pair) {
  return Spread(pair.id1) << 1 | Spread(pair.id2);
}

}  // namespace

void SortForReuse(std::vector<ImagePair>* pairs) {
  std::sort(pairs->begin(), pairs->end(), [](const ImagePair& a, const ImagePair& b) {
    return PlaceOnCurve(a) < PlaceOnCurve(b);
  });
}

}  // namespace colmap_graphmatch
