#include "colmap_graphmatch/encoding/descriptor_selection.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace colmap_graphmatch {
namespace {

constexpr Eigen::Index kDim = 128;

}  // namespace

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
