#include "colmap_graphmatch/geometry/polynomial.h"

#include <algorithm>
#include <cmath>

namespace colmap_graphmatch {
namespace {

// Newton's steps that make good what cancelled.
double Polish(double a, double b, double c, double x) {
  for (int i = 0; i < 2; ++i) {
    const double slope = (3 * x + 2 * a) * x + b;
    const double step = (((x + a) * x + b) * x + c) / slope;
    if (!(std::abs(step) < 1e-3 * (1 + std::abs(x)))) break;  // At a double root.
    x -= step;
  }
  return x;
}

}  // namespace

int CubicRoots(double a, double b, double c, std::array<double, 3>* roots) {
  // Of t^3 - 3 q t + 2 r, t = x + a / 3 (Press et al., Numerical Recipes, 5.6).
  const double q = (a * a - 3 * b) / 9;
  const double r = ((2 * a * a - 9 * b) * a + 27 * c) / 54;
  const double discriminant = q * q * q - r * r;
  if (!std::isfinite(discriminant)) return 0;
  if (discriminant >= 0) {
    const double root = std::sqrt(q);
    const double cosine = q > 0 ? std::clamp(r / (q * root), -1.0, 1.0) : 0;
    const double angle = std::acos(cosine) / 3;
    // The cosines of the angle and of a third of a turn to either side.
    const double first = std::cos(angle);
    const double half = std::sqrt(std::max(0.0, 1 - first * first)) * (std::sqrt(3.0) / 2);
    (*roots)[0] = Polish(a, b, c, -2 * root * first - a / 3);
    (*roots)[1] = Polish(a, b, c, root * (first + 2 * half) - a / 3);
    (*roots)[2] = Polish(a, b, c, root * (first - 2 * half) - a / 3);
    return 3;
  }
  const double s = -std::copysign(std::cbrt(std::abs(r) + std::sqrt(-discriminant)), r);
  (*roots)[0] = Polish(a, b, c, s + (s != 0 ? q / s : 0) - a / 3);
  return 1;
}

}  // namespace colmap_graphmatch
