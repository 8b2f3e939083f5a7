#include "colmap_graphmatch/encoding/vocabulary.h"

#include <algorithm>
#include <cstddef>

#include "colmap_graphmatch/base/random.h"

namespace colmap_graphmatch {
namespace {

// Rows whose cells are found by one task.
constexpr Eigen::Index kRowsPerTask = 4096;

int CeilDivide(Eigen::Index numerator, Eigen::Index denominator) {
  return static_cast<int>((numerator + denominator - 1) / denominator);
}

// So many rows, evenly spread over all.
RowMatrixXf Spread(const RowMatrixXf& samples, Eigen::Index num) {
  if (num >= samples.rows()) return samples;
  RowMatrixXf spread(num, samples.cols());
  for (Eigen::Index i = 0; i < num; ++i) spread.row(i) = samples.row(i * samples.rows() / num);
  return spread;
}

// The rows of the samples that belong to each cell, ascending.
std::vector<std::vector<Eigen::Index>> RowsByCell(const RowMatrixXf& samples,
                                                  const RowMatrixXf& cells, ThreadPool& threads) {
  const NearestCenter nearest_cell(cells);
  std::vector<std::uint32_t> cell_of(static_cast<std::size_t>(samples.rows()));
  const auto num_tasks = static_cast<std::size_t>(CeilDivide(samples.rows(), kRowsPerTask));
  threads.ParallelFor(num_tasks, [&](std::size_t task) {
    const Eigen::Index first = static_cast<Eigen::Index>(task) * kRowsPerTask;
    const Eigen::Index count = std::min(kRowsPerTask, samples.rows() - first);
    nearest_cell.Find(samples.row(first).data(), static_cast<std::size_t>(count),
                      cell_of.data() + first);
  });
  std::vector<std::vector<Eigen::Index>> rows(nearest_cell.NumCenters());
  for (std::size_t i = 0; i < cell_of.size(); ++i) {
    rows[cell_of[i]].push_back(static_cast<Eigen::Index>(i));
  }
  return rows;
}

Random RandomOf(std::uint64_t seed, std::uint64_t task) {
  return Random({seed, static_cast<std::uint64_t>(RandomStage::kVocabulary), task});
}

}  // namespace

std::string VocabularyOptions::Key(std::uint64_t seed) const {
  // Does not compile if a field is forgotten.
  const auto& [cells, words, training, iterations, per_cell, per_word] = *this;
  return "cells " + std::to_string(cells) + ", words " + std::to_string(words) + ", training " +
         std::to_string(training) + ", iterations " + std::to_string(iterations) +
         ", samples a cell " + std::to_string(per_cell) + ", a word " + std::to_string(per_word) +
         ", seed " + std::to_string(seed);
}

Vocabulary LearnVocabulary(const VocabularyOptions& options, std::uint64_t seed,
                           const RowMatrixXf& samples, ThreadPool& threads,
                           const StopRequest* stop) {
  Vocabulary vocabulary;
  const Eigen::Index samples_of_full_cell =
      Eigen::Index{options.min_samples_per_word} * options.num_words_per_cell;
  const int num_cells =
      std::min(options.num_cells, CeilDivide(samples.rows(), samples_of_full_cell));
  vocabulary.cells =
      LearnCenters(Spread(samples, Eigen::Index{options.num_samples_per_cell} * num_cells),
                   num_cells, options.num_iterations, RandomOf(seed, 0), &threads, stop);

  const std::vector<std::vector<Eigen::Index>> rows_by_cell =
      RowsByCell(samples, vocabulary.cells, threads);
  std::vector<RowMatrixXf> words(rows_by_cell.size());
  threads.ParallelFor(words.size(), [&](std::size_t cell) {
    const std::vector<Eigen::Index>& rows = rows_by_cell[cell];
    if (rows.empty()) {
      words[cell] = vocabulary.cells.row(static_cast<Eigen::Index>(cell));
      return;
    }
    const auto num_rows = static_cast<Eigen::Index>(rows.size());
    RowMatrixXf of_cell(num_rows, samples.cols());
    for (Eigen::Index i = 0; i < num_rows; ++i) {
      of_cell.row(i) = samples.row(rows[static_cast<std::size_t>(i)]);
    }
    const int num_words =
        std::min(options.num_words_per_cell, CeilDivide(num_rows, options.min_samples_per_word));
    words[cell] = LearnCenters(of_cell, num_words, options.num_iterations, RandomOf(seed, cell + 1),
                               nullptr, stop);
  });

  vocabulary.first_words = {0};
  for (const RowMatrixXf& of_cell : words) {
    vocabulary.first_words.push_back(vocabulary.first_words.back() +
                                     static_cast<std::uint32_t>(of_cell.rows()));
  }
  vocabulary.words.resize(vocabulary.first_words.back(), samples.cols());
  for (std::size_t cell = 0; cell < words.size(); ++cell) {
    vocabulary.words.middleRows(vocabulary.first_words[cell], words[cell].rows()) = words[cell];
  }
  return vocabulary;
}

}  // namespace colmap_graphmatch
