#pragma once

#include <array>

namespace colmap_graphmatch {

// The real roots of x^3 + a x^2 + b x + c; returns how many, 1 or 3 (equal ones as often as they
// are), or 0 if a coefficient is not finite.
int CubicRoots(double a, double b, double c, std::array<double, 3>* roots);

}  // namespace colmap_graphmatch
