#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/encoding/kmeans.h"
#include "colmap_graphmatch/encoding/matrix.h"

namespace colmap_graphmatch {

// Of a vocabulary of visual words in two levels: cells, and words within each cell.
struct VocabularyOptions {
  int num_cells = 256;
  int num_words_per_cell = 64;

  // Descriptors that it is learnt from, the same number from every image.
  int num_training_descriptors = 200000;

  // Of k-means, on each level. More change the ranked lists hardly at all.
  int num_iterations = 10;

  // The cells are learnt from so many descriptors each: they are few, and all would take as long
  // as the rest.
  int num_samples_per_cell = 200;

  // Descriptors a word at least. With a word for each descriptor no two images would share one.
  int min_samples_per_word = 4;

  // Names the values of all fields, and the seed: equal for what gives equal vocabularies alone.
  std::string Key(std::uint64_t seed) const;
};

// The words of a cell come after each other; every cell has at least one.
struct Vocabulary {
  RowMatrixXf cells;                       // C x D, the centre of each.
  RowMatrixXf words;                       // W x D, the centre of each.
  std::vector<std::uint32_t> first_words;  // C + 1: of each cell, and W.
};

// Learns words from samples (N x D, N >= 1) by k-means on both levels. From few samples, or few
// different ones, come fewer words, at least one. seed: of all that is random. The result is
// bitwise the same on any number of threads. Throws StoppedError if stop (may be null) asks for it.
Vocabulary LearnVocabulary(const VocabularyOptions& options, std::uint64_t seed,
                           const RowMatrixXf& samples, ThreadPool& threads,
                           const StopRequest* stop = nullptr);

}  // namespace colmap_graphmatch
