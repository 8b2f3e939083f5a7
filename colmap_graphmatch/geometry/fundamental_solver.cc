#include <cmath>
#include <utility>

#include "colmap_graphmatch/geometry/minimal_solvers.h"
#include "colmap_graphmatch/geometry/null_space.h"
#include "colmap_graphmatch/geometry/polynomial.h"

namespace colmap_graphmatch {
namespace {

using Entries = Eigen::Matrix<double, 9, 1>;

// The sum over the rows of `row` of determinants, the other two rows being those of `matrix`: the
// derivative of det(matrix) towards `row`.
Eigen::Matrix<double, 9, 1> Cofactors(const Entries& m) {
  Entries c;
  c << m(4) * m(8) - m(5) * m(7), m(5) * m(6) - m(3) * m(8), m(3) * m(7) - m(4) * m(6),
      m(2) * m(7) - m(1) * m(8), m(0) * m(8) - m(2) * m(6), m(1) * m(6) - m(0) * m(7),
      m(1) * m(5) - m(2) * m(4), m(2) * m(3) - m(0) * m(5), m(0) * m(4) - m(1) * m(3);
  return c;
}

}  // namespace

void SolveFundamental(const std::array<PointPair, kFundamentalSample>& sample,
                      MinimalModels* models) {
  models->num = 0;
  const Eigen::Matrix<double, 9, 2> basis = EpipolarNullSpace<kFundamentalSample>(sample.data());
  Entries f = basis.col(0);
  Entries g = basis.col(1);
  // det(z f + g) = 0.
  Entries cofactors_f = Cofactors(f);
  Entries cofactors_g = Cofactors(g);
  double det_f = f.head<3>().dot(cofactors_f.head<3>());
  double det_g = g.head<3>().dot(cofactors_g.head<3>());
  // That of the greater determinant gets z: no root is then far out.
  if (std::abs(det_f) < std::abs(det_g)) {
    std::swap(f, g);
    std::swap(cofactors_f, cofactors_g);
    std::swap(det_f, det_g);
  }
  std::array<double, 3> roots{};
  const int num =
      CubicRoots(g.dot(cofactors_f) / det_f, f.dot(cofactors_g) / det_f, det_g / det_f, &roots);
  for (int i = 0; i < num; ++i) {
    const Entries entries = roots[static_cast<std::size_t>(i)] * f + g;
    models->Add(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(entries.data()));
  }
}

}  // namespace colmap_graphmatch
