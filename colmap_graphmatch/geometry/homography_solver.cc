#include <cmath>

#include "colmap_graphmatch/geometry/minimal_solvers.h"

namespace colmap_graphmatch {
namespace {

// Twice the signed area of a triangle.
double Area(double ax, double ay, double bx, double by, double cx, double cy) {
  return (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
}

}  // namespace

void SolveHomography(const std::array<PointPair, kHomographySample>& sample,
                     MinimalModels* models) {
  models->num = 0;
  const PointPair& a = sample[0];
  const PointPair& b = sample[1];
  const PointPair& c = sample[2];
  const PointPair& d = sample[3];
  // d = s a + t b + u c in each image, but for a factor: areas that d makes with the edges.
  const double s1 = Area(d.x1, d.y1, b.x1, b.y1, c.x1, c.y1);
  const double t1 = Area(a.x1, a.y1, d.x1, d.y1, c.x1, c.y1);
  const double u1 = Area(a.x1, a.y1, b.x1, b.y1, d.x1, d.y1);
  const double s2 = Area(d.x2, d.y2, b.x2, b.y2, c.x2, c.y2);
  const double t2 = Area(a.x2, a.y2, d.x2, d.y2, c.x2, c.y2);
  const double u2 = Area(a.x2, a.y2, b.x2, b.y2, d.x2, d.y2);
  const double whole1 = s1 + t1 + u1;
  const double whole2 = s2 + t2 + u2;
  // A plane seen from one side keeps the turn of all four triangles, from the other side that of
  // none.
  const double sign = whole1 * whole2 > 0 ? 1 : -1;
  if (!(sign * s1 * s2 > 0 && sign * t1 * t2 > 0 && sign * u1 * u2 > 0)) return;
  // H = (a2 b2 c2) diag(s2 / s1, t2 / t1, u2 / u1) (a1 b1 c1)^-1
  Eigen::Matrix3d first;
  first << b.y1 - c.y1, c.x1 - b.x1, b.x1 * c.y1 - c.x1 * b.y1,  //
      c.y1 - a.y1, a.x1 - c.x1, c.x1 * a.y1 - a.x1 * c.y1,       //
      a.y1 - b.y1, b.x1 - a.x1, a.x1 * b.y1 - b.x1 * a.y1;
  first.row(0) *= s2 / s1;
  first.row(1) *= t2 / t1;
  first.row(2) *= u2 / u1;
  Eigen::Matrix3d second;
  second << a.x2, b.x2, c.x2, a.y2, b.y2, c.y2, 1, 1, 1;
  models->Add(second.lazyProduct(first));
}

}  // namespace colmap_graphmatch
