#include <Eigen/Core>
#include <cmath>
#include <utility>

#include "colmap_graphmatch/geometry/minimal_solvers.h"
#include "colmap_graphmatch/geometry/null_space.h"
#include "colmap_graphmatch/geometry/polynomial.h"

namespace colmap_graphmatch {
namespace {

// Polynomials in x, y and z of degree 1, 2 and 3: the coefficients of
//   x, y, z, 1,
//   x^2, xy, xz, x, y^2, yz, y, z^2, z, 1,
// and, in the order of Nister's table (3.2): first those that are eliminated,
//   x^3, y^3, x^2 y, x y^2, x^2 z, x^2, y^2 z, y^2, xyz, xy,
//   x z^2, xz, x, y z^2, yz, y, z^3, z^2, z, 1.
using Linear = Eigen::Matrix<double, 4, 1>;
using Quadratic = Eigen::Matrix<double, 10, 1>;

// sum += a b
void AddProduct(const Linear& a, const Linear& b, Quadratic* sum) {
  (*sum)(0) += a(0) * b(0);
  (*sum)(1) += a(0) * b(1) + a(1) * b(0);
  (*sum)(2) += a(0) * b(2) + a(2) * b(0);
  (*sum)(3) += a(0) * b(3) + a(3) * b(0);
  (*sum)(4) += a(1) * b(1);
  (*sum)(5) += a(1) * b(2) + a(2) * b(1);
  (*sum)(6) += a(1) * b(3) + a(3) * b(1);
  (*sum)(7) += a(2) * b(2);
  (*sum)(8) += a(2) * b(3) + a(3) * b(2);
  (*sum)(9) += a(3) * b(3);
}

template <class Row>
void AddProduct(const Quadratic& a, const Linear& b, Row&& sum) {
  sum(0) += a(0) * b(0);
  sum(1) += a(4) * b(1);
  sum(2) += a(0) * b(1) + a(1) * b(0);
  sum(3) += a(1) * b(1) + a(4) * b(0);
  sum(4) += a(0) * b(2) + a(2) * b(0);
  sum(5) += a(0) * b(3) + a(3) * b(0);
  sum(6) += a(4) * b(2) + a(5) * b(1);
  sum(7) += a(4) * b(3) + a(6) * b(1);
  sum(8) += a(1) * b(2) + a(2) * b(1) + a(5) * b(0);
  sum(9) += a(1) * b(3) + a(3) * b(1) + a(6) * b(0);
  sum(10) += a(2) * b(2) + a(7) * b(0);
  sum(11) += a(2) * b(3) + a(3) * b(2) + a(8) * b(0);
  sum(12) += a(3) * b(3) + a(9) * b(0);
  sum(13) += a(5) * b(2) + a(7) * b(1);
  sum(14) += a(5) * b(3) + a(6) * b(2) + a(8) * b(1);
  sum(15) += a(6) * b(3) + a(9) * b(1);
  sum(16) += a(7) * b(2);
  sum(17) += a(7) * b(3) + a(8) * b(2);
  sum(18) += a(8) * b(3) + a(9) * b(2);
  sum(19) += a(9) * b(3);
}

using Equations = Eigen::Matrix<double, 10, 20, Eigen::RowMajor>;

// det(E) = 0 and 2 E E^T E - trace(E E^T) E = 0 for E = x X + y Y + z Z + W, the columns of the
// basis.
void MakeEquations(const Eigen::Matrix<double, 9, 4>& basis, Equations* equations) {
  Linear e[3][3];
  for (int i = 0; i < 9; ++i) e[i / 3][i % 3] = basis.row(i).transpose();
  // E E^T - trace(E E^T) / 2
  Quadratic squares[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      squares[i][j].setZero();
      for (int k = 0; k < 3; ++k) AddProduct(e[i][k], e[j][k], &squares[i][j]);
    }
  }
  const Quadratic half_trace = (squares[0][0] + squares[1][1] + squares[2][2]) / 2;
  for (int i = 0; i < 3; ++i) squares[i][i] -= half_trace;
  equations->setZero();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) {
        AddProduct(squares[std::min(i, k)][std::max(i, k)], e[k][j], equations->row(3 * i + j));
      }
    }
  }
  for (int j = 0; j < 3; ++j) {
    Quadratic cofactor = Quadratic::Zero();
    AddProduct(e[1][(j + 1) % 3], e[2][(j + 2) % 3], &cofactor);
    AddProduct(-e[1][(j + 2) % 3], e[2][(j + 1) % 3], &cofactor);
    AddProduct(cofactor, e[0][j], equations->row(9));
  }
}

// Gauss and Jordan on the first ten columns, for the last six rows: those are what is asked for.
void Eliminate(Equations* equations) {
  Equations& a = *equations;
  for (int column = 0; column < 10; ++column) {
    int pivot = column;
    for (int row = column + 1; row < 10; ++row) {
      if (std::abs(a(row, column)) > std::abs(a(pivot, column))) pivot = row;
    }
    if (pivot != column) a.row(pivot).swap(a.row(column));
    const double inverse = 1 / a(column, column);
    for (int j = column; j < 20; ++j) a(column, j) *= inverse;
    for (int row = column + 1; row < 10; ++row) {
      const double factor = a(row, column);
      for (int j = column; j < 20; ++j) a(row, j) -= factor * a(column, j);
    }
  }
  for (int column = 9; column > 4; --column) {
    for (int row = 4; row < column; ++row) {
      const double factor = a(row, column);
      for (int j = 10; j < 20; ++j) a(row, j) -= factor * a(column, j);
    }
  }
}

// Polynomials in z, the constant first.
template <int kDegree>
using Polynomial = Eigen::Matrix<double, kDegree + 1, 1>;

template <int kA, int kB>
Polynomial<kA + kB> Times(const Polynomial<kA>& a, const Polynomial<kB>& b) {
  Polynomial<kA + kB> product = Polynomial<kA + kB>::Zero();
  for (int i = 0; i <= kA; ++i) {
    for (int j = 0; j <= kB; ++j) product(i + j) += a(i) * b(j);
  }
  return product;
}

template <int kDegree>
double At(const Polynomial<kDegree>& polynomial, double z) {
  double value = polynomial(kDegree);
  for (int i = kDegree - 1; i >= 0; --i) value = value * z + polynomial(i);
  return value;
}

// x(z) x + y(z) y + one(z) = 0
struct Equation {
  Polynomial<3> x;
  Polynomial<3> y;
  Polynomial<4> one;
};

// Row `a` less z times row `b`, whose leading terms are the same but for z.
Equation Subtract(const Equations& equations, int a, int b) {
  const auto p = equations.row(a).tail<10>();
  const auto q = equations.row(b).tail<10>();
  Equation equation;
  equation.x << p(2), p(1) - q(2), p(0) - q(1), -q(0);
  equation.y << p(5), p(4) - q(5), p(3) - q(4), -q(3);
  equation.one << p(9), p(8) - q(9), p(7) - q(8), p(6) - q(7), -q(6);
  return equation;
}

}  // namespace

void SolveEssential(const std::array<PointPair, kEssentialSample>& sample, MinimalModels* models) {
  models->num = 0;
  const Eigen::Matrix<double, 9, 4> basis = EpipolarNullSpace<kEssentialSample>(sample.data());
  Equations equations;
  MakeEquations(basis, &equations);
  Eliminate(&equations);
  const Equation k = Subtract(equations, 4, 5);
  const Equation l = Subtract(equations, 6, 7);
  const Equation m = Subtract(equations, 8, 9);
  // The determinant of the three equations, which have a common solution (x, y, 1).
  const Polynomial<10> determinant =
      Times<7, 3>(Times<3, 4>(k.y, l.one) - Times<3, 4>(l.y, k.one), m.x) +
      Times<7, 3>(Times<3, 4>(l.x, k.one) - Times<3, 4>(k.x, l.one), m.y) +
      Times<6, 4>(Times<3, 3>(k.x, l.y) - Times<3, 3>(l.x, k.y), m.one);
  std::array<double, 10> roots{};
  const int num = RealRoots<10>(determinant.data(), &roots);
  for (int i = 0; i < num; ++i) {
    const double z = roots[static_cast<std::size_t>(i)];
    Eigen::Matrix3d rows;
    const Equation* all[] = {&k, &l, &m};
    for (int row = 0; row < 3; ++row) {
      rows.row(row) << At<3>(all[row]->x, z), At<3>(all[row]->y, z), At<4>(all[row]->one, z);
    }
    // Of the three cross products of rows, the one that says most.
    Eigen::Vector3d solution = Eigen::Vector3d::Zero();
    for (int row = 0; row < 3; ++row) {
      const Eigen::Vector3d a = rows.row(row);
      const Eigen::Vector3d b = rows.row((row + 1) % 3);
      const Eigen::Vector3d cross(a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
                                  a.x() * b.y() - a.y() * b.x());
      if (std::abs(cross.z()) > std::abs(solution.z())) solution = cross;
    }
    const double x = solution.x() / solution.z();
    const double y = solution.y() / solution.z();
    const Eigen::Matrix<double, 9, 1> entries =
        x * basis.col(0) + y * basis.col(1) + z * basis.col(2) + basis.col(3);
    models->Add(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(entries.data()));
  }
}

}  // namespace colmap_graphmatch
