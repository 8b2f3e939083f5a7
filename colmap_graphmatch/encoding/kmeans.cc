#include "colmap_graphmatch/encoding/kmeans.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "colmap_graphmatch/encoding/descriptor_selection.h"
#include "colmap_graphmatch/encoding/matrix_product.h"

namespace colmap_graphmatch {
namespace {

// Centres a panel: with 128 dimensions a panel fills a first-level cache.
constexpr std::size_t kPanel = 64;

// Rows of samples whose sums are formed by one task. Fixed, since the order of sums must not depend
// on threads.
constexpr Eigen::Index kSamplesPerChunk = 4096;

// Samples whose products are in memory at a time: they and the products stay in the second-level
// cache. A multiple of the rows that MatrixProduct takes at a time.
constexpr std::size_t kSamplesPerBlock = 384;

std::size_t NumSampleChunks(Eigen::Index num_rows) {
  return static_cast<std::size_t>((num_rows + kSamplesPerChunk - 1) / kSamplesPerChunk);
}

// Calls body(chunk, first row, number of rows).
template <typename Body>
void ForEachSampleChunk(Eigen::Index num_rows, ThreadPool* threads, const Body& body) {
  const auto call = [&](std::size_t chunk) {
    const Eigen::Index first = static_cast<Eigen::Index>(chunk) * kSamplesPerChunk;
    body(chunk, first, std::min(kSamplesPerChunk, num_rows - first));
  };
  const std::size_t num_chunks = NumSampleChunks(num_rows);
  if (threads != nullptr) {
    threads->ParallelFor(num_chunks, call);
  } else {
    for (std::size_t chunk = 0; chunk < num_chunks; ++chunk) call(chunk);
  }
}

struct CenterSums {
  RowMatrixXd sums;  // K x D
  std::vector<std::size_t> counts;
};

// Of the samples that are nearest to each centre.
CenterSums SumByCenter(const RowMatrixXf& samples, const RowMatrixXf& centers,
                       ThreadPool* threads) {
  const NearestCenter nearest_center(centers);
  std::vector<CenterSums> partial(NumSampleChunks(samples.rows()));
  ForEachSampleChunk(
      samples.rows(), threads, [&](std::size_t chunk, Eigen::Index first, Eigen::Index count) {
        std::vector<std::uint32_t> nearest(static_cast<std::size_t>(count));
        nearest_center.Find(samples.row(first).data(), nearest.size(), nearest.data());
        CenterSums& part = partial[chunk];
        part.sums.setZero(centers.rows(), centers.cols());
        part.counts.resize(nearest_center.NumCenters());
        for (std::size_t i = 0; i < nearest.size(); ++i) {
          part.sums.row(nearest[i]) +=
              samples.row(first + static_cast<Eigen::Index>(i)).cast<double>();
          ++part.counts[nearest[i]];
        }
      });
  CenterSums all = std::move(partial[0]);
  for (std::size_t chunk = 1; chunk < partial.size(); ++chunk) {
    all.sums += partial[chunk].sums;
    for (std::size_t k = 0; k < all.counts.size(); ++k) all.counts[k] += partial[chunk].counts[k];
  }
  return all;
}

}  // namespace

NearestCenter::NearestCenter(const Eigen::Ref<const RowMatrixXf>& centers)
    : num_centers_(static_cast<std::size_t>(centers.rows())),
      dim_(static_cast<std::size_t>(centers.cols())) {
  const std::size_t num_columns =
      (num_centers_ + kColumnPadding - 1) / kColumnPadding * kColumnPadding;
  panels_.resize(num_columns * dim_);
  half_squares_.resize(num_columns, std::numeric_limits<float>::infinity());
  for (std::size_t k = 0; k < num_centers_; ++k) {
    const auto center = centers.row(static_cast<Eigen::Index>(k));
    half_squares_[k] = center.squaredNorm() / 2;
    const std::size_t first = k / kPanel * kPanel;
    const std::size_t width = std::min(kPanel, num_columns - first);
    float* const column = panels_.data() + first * dim_ + (k - first);
    for (std::size_t d = 0; d < dim_; ++d) column[d * width] = center[static_cast<Eigen::Index>(d)];
  }
}

void NearestCenter::Find(const float* samples, std::size_t num, std::uint32_t* nearest) const {
  // The nearest centre has the greatest x.c - |c|^2 / 2.
  std::vector<float> products(std::min(num, kSamplesPerBlock) * kPanel);
  std::vector<float> greatest(std::min(num, kSamplesPerBlock));
  for (std::size_t begin = 0; begin < num; begin += kSamplesPerBlock) {
    const std::size_t count = std::min(kSamplesPerBlock, num - begin);
    std::fill(greatest.begin(), greatest.end(), -std::numeric_limits<float>::infinity());
    std::fill_n(nearest + begin, count, 0U);
    for (std::size_t first = 0; first < half_squares_.size(); first += kPanel) {
      const std::size_t width = std::min(kPanel, half_squares_.size() - first);
      MatrixProduct({samples + begin * dim_, dim_, 1}, panels_.data() + first * dim_, count, dim_,
                    width, products.data());
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < width; ++k) {
          const float nearness = products[i * width + k] - half_squares_[first + k];
          if (nearness > greatest[i]) {
            greatest[i] = nearness;
            nearest[begin + i] = static_cast<std::uint32_t>(first + k);
          }
        }
      }
    }
  }
}

RowMatrixXf LearnCenters(const RowMatrixXf& samples, int num_centers, int num_iterations,
                         const Random& random, ThreadPool* threads, const StopRequest* stop) {
  const std::vector<std::size_t> chosen = SelectRandom(
      static_cast<std::size_t>(samples.rows()), static_cast<std::size_t>(num_centers), random);
  RowMatrixXf centers(static_cast<Eigen::Index>(chosen.size()), samples.cols());
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    centers.row(static_cast<Eigen::Index>(k)) = samples.row(static_cast<Eigen::Index>(chosen[k]));
  }
  for (int iteration = 0; iteration < num_iterations; ++iteration) {
    if (stop != nullptr) stop->ThrowIfRequested();
    const CenterSums sums = SumByCenter(samples, centers, threads);
    Eigen::Index num_kept = 0;
    for (std::size_t k = 0; k < sums.counts.size(); ++k) {
      if (sums.counts[k] == 0) continue;
      centers.row(num_kept++) =
          (sums.sums.row(static_cast<Eigen::Index>(k)) / static_cast<double>(sums.counts[k]))
              .cast<float>();
    }
    centers.conservativeResize(num_kept, Eigen::NoChange);
  }
  return centers;
}

}  // namespace colmap_graphmatch
