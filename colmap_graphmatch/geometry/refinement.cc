#include "colmap_graphmatch/geometry/refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

namespace colmap_graphmatch {
namespace {

constexpr int kMaxSteps = 5;
// Of the loss: less is not worth another step.
constexpr double kLeastGain = 1e-3;

// What F or E is made of: u diag(1, s, 0) v^T with rotations u and v; s is 1 for E.
struct Factors {
  Eigen::Matrix3d u;
  Eigen::Matrix3d v;
  double s = 1;

  Eigen::Matrix3d Product() const {
    return u.col(0) * v.col(0).transpose() + s * u.col(1) * v.col(1).transpose();
  }
};

bool Factorize(const Eigen::Matrix3d& model, bool essential, Factors* factors) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(model, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& values = svd.singularValues();
  if (!(values(1) > 0) || !values.allFinite()) return false;
  factors->u = svd.matrixU();
  factors->v = svd.matrixV();
  if (factors->u.determinant() < 0) factors->u.col(2) *= -1;
  if (factors->v.determinant() < 0) factors->v.col(2) *= -1;
  factors->s = essential ? 1 : values(1) / values(0);
  return true;
}

Eigen::Matrix3d Rotation(const Eigen::Vector3d& axis) {
  // Cayley's: a rotation whatever the length, and the axis itself to first order.
  return Eigen::Quaterniond(1, axis.x() / 2, axis.y() / 2, axis.z() / 2)
      .normalized()
      .toRotationMatrix();
}

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Minimises by steps from a start. Problem: kParameters; State; ToModel(state) in the coordinates
// of the columns; Tangents(state): the derivatives of the model's entries; Moved(state, step).
template <class Problem>
FittedModel Minimize(const Problem& problem, typename Problem::State state, ErrorKind kind,
                     const PointPairs& pairs, double max_squared_error) {
  constexpr int kParameters = Problem::kParameters;
  using Square = Eigen::Matrix<double, kParameters, kParameters>;
  using Vector = Eigen::Matrix<double, kParameters, 1>;
  const auto loss = [&](const NormalEquations& equations) {
    return equations.sum_squared +
           max_squared_error * static_cast<double>(pairs.Num() - equations.num_inliers);
  };
  Eigen::Matrix3d model = problem.ToModel(state);
  double norm = model.norm();
  NormalEquations equations;
  ComputeNormalEquations(kind, pairs, model, max_squared_error, &equations);
  FittedModel best{model, equations.num_inliers, equations.sum_squared};
  double best_loss = loss(equations);
  double damping = 1e-4;
  NormalEquations moved_equations;
  for (int step = 0; step < kMaxSteps; ++step) {
    // The derivatives are by the entries of the model divided by its norm; to divide by it is to
    // move along the model, which changes no residual.
    const Eigen::Matrix<double, 9, kParameters> tangents = problem.Tangents(state) / norm;
    Square jtj = tangents.transpose() * equations.jtj * tangents;
    const Vector jtr = tangents.transpose() * equations.jtr;
    jtj.diagonal().array() += damping * jtj.trace() / kParameters;
    const Vector delta = jtj.ldlt().solve(-jtr);
    if (!delta.allFinite()) break;
    const typename Problem::State moved = problem.Moved(state, delta);
    const Eigen::Matrix3d moved_model = problem.ToModel(moved);
    ComputeNormalEquations(kind, pairs, moved_model, max_squared_error, &moved_equations);
    const double moved_loss = loss(moved_equations);
    const FittedModel candidate{moved_model, moved_equations.num_inliers,
                                moved_equations.sum_squared};
    if (candidate.IsBetterThan(best)) best = candidate;
    if (!(moved_loss < best_loss)) {
      damping *= 100;
      if (damping > 1) break;
      continue;
    }
    const bool is_last = best_loss - moved_loss < kLeastGain * best_loss;
    state = moved;
    model = moved_model;
    norm = model.norm();
    equations = moved_equations;
    best_loss = moved_loss;
    damping = std::max(damping / 10, 1e-7);
    if (is_last) break;
  }
  return best;
}

struct HomographyProblem {
  static constexpr int kParameters = 9;
  using State = Eigen::Matrix3d;

  Eigen::Matrix3d ToModel(const State& state) const { return state; }
  Eigen::Matrix<double, 9, 9> Tangents(const State& /*state*/) const {
    return Eigen::Matrix<double, 9, 9>::Identity();
  }
  State Moved(const State& state, const Eigen::Matrix<double, 9, 1>& delta) const {
    return (state + Eigen::Map<const RowMajor>(delta.data())).normalized();
  }
};

template <bool kEssential>
struct EpipolarProblem {
  // Rotations of u and v about x and y, of one of them about z (of both for F), and s.
  static constexpr int kParameters = kEssential ? 5 : 7;
  using State = Factors;
  using Vector = Eigen::Matrix<double, kParameters, 1>;

  Eigen::Matrix3d to_normalized1;
  Eigen::Matrix3d to_normalized2;

  Eigen::Matrix3d ToModel(const State& state) const { return InColumns(state.Product()); }

  Eigen::Matrix<double, 9, kParameters> Tangents(const State& state) const {
    const Eigen::Vector3d d(1, state.s, 0);
    Eigen::Matrix<double, 9, kParameters> tangents;
    int parameter = 0;
    const auto add = [&](const Eigen::Matrix3d& inner) {
      const RowMajor tangent = InColumns(state.u * inner * state.v.transpose());
      tangents.col(parameter++) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(tangent.data());
    };
    for (int axis = 0; axis < 3; ++axis) add(Cross(axis) * d.asDiagonal());
    for (int axis = 0; axis < (kEssential ? 2 : 3); ++axis) add(d.asDiagonal() * -Cross(axis));
    if constexpr (!kEssential) add(Eigen::Vector3d::UnitY().asDiagonal());
    return tangents;
  }

  State Moved(const State& state, const Vector& delta) const {
    State moved = state;
    moved.u = state.u * Rotation(delta.template head<3>());
    Eigen::Vector3d v = Eigen::Vector3d::Zero();
    v.head<kEssential ? 2 : 3>() = delta.template segment < kEssential ? 2 : 3 > (3);
    moved.v = state.v * Rotation(v);
    if constexpr (!kEssential) moved.s = state.s + delta(6);
    return moved;
  }

 private:
  Eigen::Matrix3d InColumns(const Eigen::Matrix3d& model) const {
    if constexpr (kEssential) return to_normalized2.transpose() * model * to_normalized1;
    return model;
  }

  static Eigen::Matrix3d Cross(int axis) {
    Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
    cross((axis + 2) % 3, (axis + 1) % 3) = 1;
    cross((axis + 1) % 3, (axis + 2) % 3) = -1;
    return cross;
  }
};

}  // namespace

Refiner::Refiner(ModelKind kind, const PointPairs& pairs, double max_squared_error,
                 const Eigen::Matrix3d& to_normalized1, const Eigen::Matrix3d& to_normalized2)
    : kind_(kind),
      pairs_(pairs),
      max_squared_error_(max_squared_error),
      to_normalized1_(to_normalized1),
      to_normalized2_(to_normalized2) {}

FittedModel Refiner::Refine(const Eigen::Matrix3d& model) const {
  if (!model.allFinite()) return {};
  return kind_ == ModelKind::kHomography ? RefineHomography(model) : RefineEpipolar(model);
}

FittedModel Refiner::RefineHomography(const Eigen::Matrix3d& model) const {
  return Minimize(HomographyProblem(), Eigen::Matrix3d(model.normalized()), ErrorKind::kHomography,
                  pairs_, max_squared_error_);
}

FittedModel Refiner::RefineEpipolar(const Eigen::Matrix3d& model) const {
  Factors factors;
  if (kind_ == ModelKind::kFundamental) {
    if (!Factorize(model, false, &factors)) return {};
    return Minimize(EpipolarProblem<false>(), factors, ErrorKind::kEpipolar, pairs_,
                    max_squared_error_);
  }
  const Eigen::Matrix3d essential =
      to_normalized2_.inverse().transpose() * model * to_normalized1_.inverse();
  if (!Factorize(essential, true, &factors)) return {};
  const EpipolarProblem<true> problem{to_normalized1_, to_normalized2_};
  return Minimize(problem, factors, ErrorKind::kEpipolar, pairs_, max_squared_error_);
}

}  // namespace colmap_graphmatch
