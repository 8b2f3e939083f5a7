#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/visual_words.h"
#include "colmap_graphmatch/encoding/kmeans.h"
#include "colmap_graphmatch/encoding/matrix.h"
#include "colmap_graphmatch/encoding/vocabulary.h"

namespace colmap_graphmatch {

// num rows of 128-dimensional descriptors as COLMAP stores them (one byte an entry), divided by
// their sums and square-rooted: RootSIFT (Arandjelovic and Zisserman, CVPR 2012), of unit length. A
// descriptor of zeros stays one.
RowMatrixXf RootSift(const std::uint8_t* descriptors, std::size_t num);

// Turns the features of an image into visual words for an aggregated selective match kernel
// (Tolias, Avrithis and Jegou, ICCV 2013, sections 3 and 4). Thread-safe.
class VisualWordEncoder {
 public:
  // vocabulary: of 128 dimensions. It must outlive this.
  explicit VisualWordEncoder(const Vocabulary& vocabulary);

  // Of descriptors x_i (N x 128). Each belongs to the nearest cell and there to the nearest word
  // (of equally near ones the first); the signs of a word c are those of sum_i (x_i - c), over the
  // descriptors that belong to it, in their order and in single precision.
  VisualWords Encode(const RowMatrixXf& descriptors) const;

 private:
  void EncodeCell(std::size_t cell, const RowMatrixXf& descriptors,
                  const std::vector<Eigen::Index>& rows, VisualWords* encoded) const;

  const Vocabulary& vocabulary_;
  NearestCenter nearest_cell_;
  std::vector<NearestCenter> nearest_words_;  // By cell.
};

}  // namespace colmap_graphmatch
