#include "colmap_graphmatch/encoding/visual_word_encoder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace colmap_graphmatch {
namespace {

constexpr Eigen::Index kSignsDim = 128;

Signs SignsOf(const float* sums) {
  Signs signs = {};
  for (std::size_t d = 0; d < kSignsDim; ++d) {
    signs[d / 64] |= std::uint64_t{sums[d] > 0} << (d % 64);
  }
  return signs;
}

}  // namespace

RowMatrixXf RootSift(const std::uint8_t* descriptors, std::size_t num) {
  std::array<float, 256> roots = {};
  for (std::size_t i = 0; i < roots.size(); ++i) roots[i] = std::sqrt(static_cast<float>(i));
  RowMatrixXf rows(static_cast<Eigen::Index>(num), kSignsDim);
  for (std::size_t i = 0; i < num; ++i) {
    const std::uint8_t* const entries = descriptors + i * kSignsDim;
    const unsigned sum = std::accumulate(entries, entries + kSignsDim, 0U);
    const float factor = sum > 0 ? 1 / std::sqrt(static_cast<float>(sum)) : 0;
    float* const row = rows.data() + i * kSignsDim;
    for (std::size_t d = 0; d < kSignsDim; ++d) row[d] = roots[entries[d]] * factor;
  }
  return rows;
}

VisualWordEncoder::VisualWordEncoder(const Vocabulary& vocabulary)
    : vocabulary_(vocabulary), nearest_cell_(vocabulary.cells) {
  nearest_words_.reserve(nearest_cell_.NumCenters());
  for (std::size_t cell = 0; cell < nearest_cell_.NumCenters(); ++cell) {
    const std::uint32_t first = vocabulary.first_words[cell];
    nearest_words_.emplace_back(
        vocabulary.words.middleRows(first, vocabulary.first_words[cell + 1] - first));
  }
}

VisualWords VisualWordEncoder::Encode(const RowMatrixXf& descriptors) const {
  std::vector<std::uint32_t> cell_of(static_cast<std::size_t>(descriptors.rows()));
  nearest_cell_.Find(descriptors.data(), cell_of.size(), cell_of.data());
  std::vector<std::vector<Eigen::Index>> rows_by_cell(nearest_cell_.NumCenters());
  for (std::size_t i = 0; i < cell_of.size(); ++i) {
    rows_by_cell[cell_of[i]].push_back(static_cast<Eigen::Index>(i));
  }
  VisualWords encoded;
  for (std::size_t cell = 0; cell < rows_by_cell.size(); ++cell) {
    if (!rows_by_cell[cell].empty()) EncodeCell(cell, descriptors, rows_by_cell[cell], &encoded);
  }
  return encoded;
}

void VisualWordEncoder::EncodeCell(std::size_t cell, const RowMatrixXf& descriptors,
                                   const std::vector<Eigen::Index>& rows,
                                   VisualWords* encoded) const {
  RowMatrixXf of_cell(static_cast<Eigen::Index>(rows.size()), kSignsDim);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    of_cell.row(static_cast<Eigen::Index>(i)) = descriptors.row(rows[i]);
  }
  std::vector<std::uint32_t> word_of(rows.size());
  nearest_words_[cell].Find(of_cell.data(), word_of.size(), word_of.data());
  const std::uint32_t first = vocabulary_.first_words[cell];
  RowMatrixXf sums =
      RowMatrixXf::Zero(static_cast<Eigen::Index>(nearest_words_[cell].NumCenters()), kSignsDim);
  std::vector<bool> is_there(nearest_words_[cell].NumCenters());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::uint32_t word = word_of[i];
    sums.row(word) +=
        of_cell.row(static_cast<Eigen::Index>(i)) - vocabulary_.words.row(first + word);
    is_there[word] = true;
  }
  for (std::uint32_t word = 0; word < is_there.size(); ++word) {
    if (!is_there[word]) continue;
    encoded->words.push_back(first + word);
    encoded->signs.push_back(SignsOf(sums.row(word).data()));
  }
}

}  // namespace colmap_graphmatch
