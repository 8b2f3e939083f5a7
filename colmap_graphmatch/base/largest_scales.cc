#include "colmap_graphmatch/base/largest_scales.h"

#include <algorithm>
#include <numeric>

namespace colmap_graphmatch {

std::vector<std::size_t> SelectLargestScales(const std::vector<float>& scales,
                                             std::size_t max_num) {
  std::vector<std::size_t> rows(scales.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  if (rows.size() <= max_num) return rows;
  // Comparisons with NaN are all false, which would be no order at all.
  const auto scale = [&](std::size_t row) { return scales[row] > 0 ? scales[row] : 0.0F; };
  const auto end = rows.begin() + static_cast<std::ptrdiff_t>(max_num);
  std::nth_element(rows.begin(), end, rows.end(), [&](std::size_t a, std::size_t b) {
    return scale(a) != scale(b) ? scale(a) > scale(b) : a < b;
  });
  rows.erase(end, rows.end());
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace colmap_graphmatch
