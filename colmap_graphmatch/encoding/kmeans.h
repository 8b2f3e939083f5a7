#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/encoding/matrix.h"

namespace colmap_graphmatch {

// Finds the nearest of K centres, which are at most some hundreds. Thread-safe.
class NearestCenter {
 public:
  // centers: K x D, K >= 1.
  explicit NearestCenter(const Eigen::Ref<const RowMatrixXf>& centers);

  std::size_t NumCenters() const { return num_centers_; }

  // nearest[i] = the centre that sample i (of num rows of D floats) is nearest to, by squared
  // distances in single precision; of equally near ones the first. The result for a sample does not
  // depend on the others.
  void Find(const float* samples, std::size_t num, std::uint32_t* nearest) const;

 private:
  std::size_t num_centers_;
  std::size_t dim_;
  // The centres as columns, in panels of kPanel, each D x kPanel or less and row-major.
  std::vector<float> panels_;
  std::vector<float> half_squares_;  // |c|^2 / 2; infinite for the columns that pad a panel.
};

// Lloyd's k-means from randomly chosen samples (N x D, N >= 1): so many iterations. (A start by
// k-means++ takes longer and makes worse words: it likes outliers.) Centres that no sample is
// nearest to are dropped, so there may be fewer, at least 1. Returns K x D. Bitwise the same on any
// number of threads; null for the calling one alone. Throws StoppedError if stop (may be null) asks
// for it.
RowMatrixXf LearnCenters(const RowMatrixXf& samples, int num_centers, int num_iterations,
                         const Random& random, ThreadPool* threads, const StopRequest* stop);

}  // namespace colmap_graphmatch
