#include "colmap_graphmatch/encoding/gmm.h"

#include <algorithm>
#include <cmath>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/exact_text.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/encoding/matrix_product.h"

namespace colmap_graphmatch {
namespace {

// Rows a block: a block of 128-dimensional samples with their squares fits the second-level cache.
constexpr Eigen::Index kBlockRows = 256;

// Rows a chunk: the unit of parallel work. Fixed, since the order of sums must not depend on
// threads.
constexpr Eigen::Index kChunkRows = 4096;

// A component that holds less than this share of a sample is empty.
constexpr double kEmptyComponent = 1e-3;

// Components replaced during one training at most, lest EM empties and refills the same one for
// ever.
constexpr int kMaxReplacedComponents = 16;

constexpr double kLog2Pi = 1.8378770664093454836;

Eigen::Index PaddedColumns(Eigen::Index num) {
  const auto padding = static_cast<Eigen::Index>(kColumnPadding);
  return (num + padding - 1) / padding * padding;
}

// A view of the transpose costs nothing: the strides change places.
MatrixView View(const RowMatrixXf& matrix) {
  return {matrix.data(), static_cast<std::size_t>(matrix.cols()), 1};
}
MatrixView TransposeView(const RowMatrixXf& matrix) {
  return {matrix.data(), 1, static_cast<std::size_t>(matrix.cols())};
}

void Multiply(const MatrixView& a, const RowMatrixXf& b, RowMatrixXf* c) {
  MatrixProduct(a, b.data(), static_cast<std::size_t>(c->rows()),
                static_cast<std::size_t>(b.rows()), static_cast<std::size_t>(b.cols()), c->data());
}

std::size_t NumChunks(Eigen::Index num_rows) {
  return static_cast<std::size_t>((num_rows + kChunkRows - 1) / kChunkRows);
}

// Calls body(chunk, first row, number of rows).
template <typename Body>
void ForEachChunk(Eigen::Index num_rows, ThreadPool& threads, const Body& body) {
  threads.ParallelFor(NumChunks(num_rows), [&](std::size_t chunk) {
    const Eigen::Index first = static_cast<Eigen::Index>(chunk) * kChunkRows;
    body(chunk, first, std::min(kChunkRows, num_rows - first));
  });
}

SufficientStatistics Statistics(const GmmEvaluator& evaluator, const RowMatrixXf& samples,
                                Eigen::Index num_components, ThreadPool& threads) {
  std::vector<SufficientStatistics> partial(NumChunks(samples.rows()),
                                            SufficientStatistics(num_components, samples.cols()));
  ForEachChunk(samples.rows(), threads,
               [&](std::size_t chunk, Eigen::Index first, Eigen::Index num_rows) {
                 evaluator.Accumulate(samples.middleRows(first, num_rows), &partial[chunk]);
               });
  SufficientStatistics sums(num_components, samples.cols());
  for (const SufficientStatistics& part : partial) sums.Add(part);
  return sums;
}

// The rows chosen by k-means++: each next one with probability proportional to its squared distance
// to those already chosen. Fewer than num_centers when no other different sample is left.
std::vector<Eigen::Index> ChooseCenters(const RowMatrixXf& samples, int num_centers,
                                        std::uint64_t seed, ThreadPool& threads) {
  Random random({seed, static_cast<std::uint64_t>(RandomStage::kKMeans)});
  const Eigen::Index num_rows = samples.rows();
  std::vector<Eigen::Index> centers = {
      static_cast<Eigen::Index>(random.Index(static_cast<std::uint64_t>(num_rows)))};
  Eigen::VectorXf distances = Eigen::VectorXf::Constant(num_rows, INFINITY);
  std::vector<double> chunk_sums(NumChunks(num_rows));
  while (static_cast<int>(centers.size()) < num_centers) {
    const auto center = samples.row(centers.back());
    ForEachChunk(num_rows, threads, [&](std::size_t chunk, Eigen::Index first, Eigen::Index count) {
      double sum = 0;
      for (Eigen::Index i = first; i < first + count; ++i) {
        distances[i] = std::min(distances[i], (samples.row(i) - center).squaredNorm());
        sum += distances[i];
      }
      chunk_sums[chunk] = sum;
    });
    double total = 0;
    for (const double sum : chunk_sums) total += sum;
    if (!(total > 0)) break;

    double remaining = random.Uniform() * total;
    Eigen::Index chosen = -1;
    for (Eigen::Index i = 0; i < num_rows; ++i) {
      if (distances[i] <= 0) continue;
      chosen = i;
      remaining -= distances[i];
      if (remaining < 0) break;
    }
    centers.push_back(chosen);
  }
  return centers;
}

GaussianMixture InitialMixture(const GmmOptions& options, std::uint64_t seed,
                               const RowMatrixXf& samples, ThreadPool& threads) {
  std::vector<Eigen::RowVectorXd> sums(NumChunks(samples.rows()));
  ForEachChunk(samples.rows(), threads,
               [&](std::size_t chunk, Eigen::Index first, Eigen::Index count) {
                 sums[chunk] = samples.middleRows(first, count).cast<double>().colwise().sum();
               });
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(samples.cols());
  for (const Eigen::RowVectorXd& sum : sums) mean += sum;
  mean /= static_cast<double>(samples.rows());

  ForEachChunk(samples.rows(), threads,
               [&](std::size_t chunk, Eigen::Index first, Eigen::Index count) {
                 sums[chunk] = (samples.middleRows(first, count).cast<double>().rowwise() - mean)
                                   .array()
                                   .square()
                                   .matrix()
                                   .colwise()
                                   .sum();
               });
  Eigen::RowVectorXd variance = Eigen::RowVectorXd::Zero(samples.cols());
  for (const Eigen::RowVectorXd& sum : sums) variance += sum;
  variance = (variance / static_cast<double>(samples.rows())).cwiseMax(options.variance_floor);

  const std::vector<Eigen::Index> centers =
      ChooseCenters(samples, options.num_components, seed, threads);
  const auto num_components = static_cast<Eigen::Index>(centers.size());
  GaussianMixture mixture;
  mixture.weights =
      Eigen::VectorXd::Constant(num_components, 1.0 / static_cast<double>(num_components));
  mixture.means.resize(num_components, samples.cols());
  for (Eigen::Index k = 0; k < num_components; ++k) {
    mixture.means.row(k) = samples.row(centers[static_cast<std::size_t>(k)]).cast<double>();
  }
  mixture.variances = variance.replicate(num_components, 1);
  return mixture;
}

// M-step. Components without samples keep their place and get no weight.
void Maximize(const SufficientStatistics& sums, const Eigen::RowVectorXd& origin,
              double variance_floor, GaussianMixture* mixture) {
  const double total = sums.s0.sum();
  for (Eigen::Index k = 0; k < mixture->NumComponents(); ++k) {
    const double weight = sums.s0[k];
    mixture->weights[k] = weight / total;
    if (weight < kEmptyComponent) continue;
    const Eigen::RowVectorXd shift = sums.s1.row(k) / weight;
    mixture->means.row(k) = origin + shift;
    mixture->variances.row(k) =
        (sums.s2.row(k) / weight - shift.cwiseAbs2()).cwiseMax(variance_floor);
  }
}

// Splits the widest component along its widest dimension and gives one half to each empty one.
int ReplaceEmptyComponents(const Eigen::VectorXd& s0, int max_replaced, GaussianMixture* mixture) {
  int num_replaced = 0;
  for (Eigen::Index k = 0; k < mixture->NumComponents() && num_replaced < max_replaced; ++k) {
    if (s0[k] >= kEmptyComponent) continue;
    Eigen::Index widest = -1;
    double width = 0;
    for (Eigen::Index j = 0; j < mixture->NumComponents(); ++j) {
      const double sum = mixture->variances.row(j).sum();
      if (s0[j] >= 2 && sum > width) {
        widest = j;
        width = sum;
      }
    }
    if (widest < 0) break;
    Eigen::Index dim = 0;
    const double step = std::sqrt(mixture->variances.row(widest).maxCoeff(&dim));
    mixture->weights[widest] /= 2;
    mixture->weights[k] = mixture->weights[widest];
    mixture->variances.row(k) = mixture->variances.row(widest);
    mixture->means.row(k) = mixture->means.row(widest);
    mixture->means(k, dim) += step;
    mixture->means(widest, dim) -= step;
    ++num_replaced;
  }
  return num_replaced;
}

}  // namespace

void GmmOptions::Check() const {
  if (num_components < 1)
    throw OptionsError("The number of Gaussian components must be at least 1.");
  if (!(tolerance >= 0)) throw OptionsError("The tolerance of EM must not be negative.");
  if (max_num_iterations < 1) throw OptionsError("EM needs at least one iteration.");
  if (!(variance_floor > 0)) throw OptionsError("The smallest variance must be positive.");
}

std::string GmmOptions::Key(std::uint64_t seed) const {
  // Does not compile if a field is forgotten.
  const auto& [components, least_growth, iterations, floor] = *this;
  return "components " + std::to_string(components) + ", tolerance " + ExactText(least_growth) +
         ", iterations " + std::to_string(iterations) + ", variance floor " + ExactText(floor) +
         ", seed " + std::to_string(seed);
}

SufficientStatistics::SufficientStatistics(Eigen::Index num_components, Eigen::Index dim)
    : s0(Eigen::VectorXd::Zero(num_components)),
      s1(RowMatrixXd::Zero(num_components, dim)),
      s2(RowMatrixXd::Zero(num_components, dim)) {}

void SufficientStatistics::Add(const SufficientStatistics& other) {
  log_likelihood += other.log_likelihood;
  s0 += other.s0;
  s1 += other.s1;
  s2 += other.s2;
}

GmmEvaluator::GmmEvaluator(const GaussianMixture& mixture)
    : origin_(mixture.weights.transpose() * mixture.means), origin_float_(origin_.cast<float>()) {
  // The samples are shifted in single precision, so the shift itself has to be exactly that number.
  origin_ = origin_float_.cast<double>();
  const RowMatrixXd means = mixture.means.rowwise() - origin_;
  const RowMatrixXd precisions = mixture.variances.cwiseInverse();
  coefficients_.setZero(2 * mixture.Dim(), PaddedColumns(mixture.NumComponents()));
  coefficients_.topLeftCorner(mixture.Dim(), mixture.NumComponents()) =
      means.cwiseProduct(precisions).transpose().cast<float>();
  coefficients_.bottomLeftCorner(mixture.Dim(), mixture.NumComponents()) =
      (-0.5 * precisions).transpose().cast<float>();
  const Eigen::VectorXd constants =
      mixture.weights.array().max(1e-300).log() -
      0.5 * (mixture.variances.array().log().rowwise().sum() +
             kLog2Pi * static_cast<double>(mixture.Dim()) +
             means.array().square().cwiseProduct(precisions.array()).rowwise().sum());
  constants_ = constants.transpose().cast<float>();
}

double GmmEvaluator::EvaluateBlock(const Eigen::Ref<const RowMatrixXf>& samples,
                                   RowMatrixXf* values, RowMatrixXf* responsibilities) const {
  const Eigen::Index dim = samples.cols();
  const Eigen::Index num_components = constants_.size();
  // The columns that pad it stay zero from block to block.
  if (values->rows() != samples.rows()) values->setZero(samples.rows(), PaddedColumns(2 * dim));
  values->leftCols(dim) = samples.rowwise() - origin_float_;
  values->middleCols(dim, dim) = values->leftCols(dim).cwiseAbs2();
  responsibilities->resize(samples.rows(), coefficients_.cols());
  Multiply(View(*values), coefficients_, responsibilities);
  double log_likelihood = 0;
  for (Eigen::Index i = 0; i < responsibilities->rows(); ++i) {
    auto row = responsibilities->row(i).head(num_components);
    row += constants_;
    const float maximum = row.maxCoeff();
    row = (row.array() - maximum).exp();
    const float sum = row.sum();
    row /= sum;
    log_likelihood += static_cast<double>(maximum) + std::log(static_cast<double>(sum));
  }
  return log_likelihood;
}

void GmmEvaluator::Accumulate(const Eigen::Ref<const RowMatrixXf>& samples,
                              SufficientStatistics* sums) const {
  const Eigen::Index dim = samples.cols();
  RowMatrixXf values;
  RowMatrixXf responsibilities;
  RowMatrixXf products(constants_.size(), PaddedColumns(2 * dim));
  for (Eigen::Index first = 0; first < samples.rows(); first += kBlockRows) {
    const Eigen::Index num_rows = std::min(kBlockRows, samples.rows() - first);
    sums->log_likelihood +=
        EvaluateBlock(samples.middleRows(first, num_rows), &values, &responsibilities);
    Multiply(TransposeView(responsibilities), values, &products);
    sums->s0 +=
        responsibilities.leftCols(constants_.size()).cast<double>().colwise().sum().transpose();
    sums->s1 += products.leftCols(dim).cast<double>();
    sums->s2 += products.middleCols(dim, dim).cast<double>();
  }
}

RowMatrixXf GmmEvaluator::Responsibilities(const Eigen::Ref<const RowMatrixXf>& samples) const {
  RowMatrixXf values;
  RowMatrixXf responsibilities;
  EvaluateBlock(samples, &values, &responsibilities);
  return responsibilities.leftCols(constants_.size());
}

GmmTraining TrainGmm(const GmmOptions& options, std::uint64_t seed, const RowMatrixXf& samples,
                     ThreadPool& threads, const StopRequest* stop) {
  options.Check();
  if (samples.rows() == 0) throw OptionsError("A Gaussian mixture needs at least one sample.");

  GmmTraining training;
  training.mixture = InitialMixture(options, seed, samples, threads);
  GaussianMixture& mixture = training.mixture;
  double previous = -INFINITY;
  for (int iteration = 0; iteration < options.max_num_iterations; ++iteration) {
    if (stop != nullptr) stop->ThrowIfRequested();
    const GmmEvaluator evaluator(mixture);
    const SufficientStatistics sums =
        Statistics(evaluator, samples, mixture.NumComponents(), threads);
    const double log_likelihood = sums.log_likelihood / static_cast<double>(samples.rows());
    training.log_likelihoods.push_back(log_likelihood);
    if (log_likelihood - previous <= options.tolerance * std::abs(log_likelihood)) {
      training.converged = true;
      break;
    }
    previous = log_likelihood;
    Maximize(sums, evaluator.Origin(), options.variance_floor, &mixture);
    const int num_replaced = ReplaceEmptyComponents(
        sums.s0, kMaxReplacedComponents - training.num_replaced_components, &mixture);
    if (num_replaced > 0) {
      training.num_replaced_components += num_replaced;
      previous = -INFINITY;
    }
  }
  // No component may be left with no weight at all: the Fisher vector divides by its square root.
  const double smallest = kEmptyComponent / static_cast<double>(samples.rows());
  mixture.weights = mixture.weights.cwiseMax(smallest);
  mixture.weights /= mixture.weights.sum();
  return training;
}

}  // namespace colmap_graphmatch
