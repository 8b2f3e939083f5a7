#include "colmap_graphmatch/graph/edge_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace colmap_graphmatch {
namespace {

constexpr int kNum = static_cast<int>(kNumCues);
using Vector = Eigen::Matrix<double, kNum, 1>;
using Matrix = Eigen::Matrix<double, kNum, kNum>;

// As much as a few tests would say.
constexpr double kPull = 1;
constexpr int kMaxIterations = 30;
constexpr double kTolerance = 1e-6;

double Sigmoid(double x) { return 1 / (1 + std::exp(-x)); }

// log(1 + exp(x))
double SoftPlus(double x) { return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x))); }

}  // namespace

void EdgeModel::Fit(const std::vector<LabelledCues>& tested) {
  const std::size_t first = tested.size() - std::min(tested.size(), kMaxTests);
  const auto loss = [&](const Vector& coefficients) {
    double sum = kPull / 2 * coefficients.squaredNorm();
    for (std::size_t i = first; i < tested.size(); ++i) {
      const double x = coefficients.dot(Eigen::Map<const Vector>(tested[i].cues.data()));
      sum += SoftPlus(tested[i].is_edge ? -x : x);
    }
    return sum;
  };
  // From where it was: little has changed.
  Vector coefficients = Eigen::Map<const Vector>(coefficients_.data());
  double last_loss = loss(coefficients);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    Vector gradient = kPull * coefficients;
    Matrix hessian = kPull * Matrix::Identity();
    for (std::size_t i = first; i < tested.size(); ++i) {
      const Eigen::Map<const Vector> cues(tested[i].cues.data());
      const double p = Sigmoid(coefficients.dot(cues));
      gradient += (p - (tested[i].is_edge ? 1 : 0)) * cues;
      hessian.selfadjointView<Eigen::Lower>().rankUpdate(cues, p * (1 - p));
    }
    Vector step = hessian.selfadjointView<Eigen::Lower>().ldlt().solve(gradient);
    double next_loss = loss(coefficients - step);
    for (int halving = 0; halving < 10 && next_loss > last_loss; ++halving) {
      step /= 2;
      next_loss = loss(coefficients - step);
    }
    if (!(next_loss <= last_loss)) break;
    coefficients -= step;
    const bool has_converged = last_loss - next_loss <= kTolerance * last_loss;
    last_loss = next_loss;
    if (has_converged) break;
  }
  Eigen::Map<Vector>(coefficients_.data()) = coefficients;
}

double EdgeModel::Probability(const Cues& cues) const {
  double sum = 0;
  for (std::size_t i = 0; i < kNumCues; ++i) sum += coefficients_[i] * cues[i];
  return Sigmoid(sum);
}

}  // namespace colmap_graphmatch
