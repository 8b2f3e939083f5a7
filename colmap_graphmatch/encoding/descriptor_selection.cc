#include "colmap_graphmatch/encoding/descriptor_selection.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace colmap_graphmatch {
namespace {

constexpr Eigen::Index kDim = 128;

}  // namespace

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

std::vector<std::size_t> SelectRandom(std::size_t num_rows, std::size_t max_num, Random random) {
  std::vector<std::size_t> rows(num_rows);
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  if (num_rows <= max_num) return rows;
  for (std::size_t i = 0; i < max_num; ++i) {
    std::swap(rows[i], rows[i + random.Index(num_rows - i)]);
  }
  rows.resize(max_num);
  std::sort(rows.begin(), rows.end());
  return rows;
}

RowMatrixXf DescriptorsToFloat(const std::uint8_t* descriptors, std::size_t num) {
  using Bytes = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, kDim, Eigen::RowMajor>;
  return Eigen::Map<const Bytes>(descriptors, static_cast<Eigen::Index>(num), kDim).cast<float>() /
         512.0F;
}

}  // namespace colmap_graphmatch
