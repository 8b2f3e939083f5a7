#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace colmap_graphmatch {

// The real roots of x^3 + a x^2 + b x + c; returns how many, 1 or 3 (equal ones as often as they
// are), or 0 if a coefficient is not finite.
int CubicRoots(double a, double b, double c, std::array<double, 3>* roots);

inline double Evaluate(const double* coefficients, int degree, double x) {
  double value = coefficients[degree];
  for (int i = degree - 1; i >= 0; --i) value = value * x + coefficients[i];
  return value;
}

// The value of a polynomial, the constant first, and of its derivative.
inline double Evaluate(const double* coefficients, int degree, double x, double* derivative) {
  double value = coefficients[degree];
  *derivative = 0;
  for (int i = degree - 1; i >= 0; --i) {
    *derivative = *derivative * x + value;
    value = value * x + coefficients[i];
  }
  return value;
}

// The root of a polynomial between two places where its signs differ, by Newton's steps, or by
// halving where they leave the interval or gain too little.
inline double RootBetween(const double* coefficients, int degree, double low, double high,
                          bool is_negative_at_low, double tolerance) {
  constexpr int kMaxSteps = 60;
  double x = 0.5 * (low + high);
  double last_step = high - low;
  for (int i = 0; i < kMaxSteps; ++i) {
    double slope = 0;
    const double value = Evaluate(coefficients, degree, x, &slope);
    if (value == 0) return x;
    ((value < 0) == is_negative_at_low ? low : high) = x;
    double next = x - value / slope;
    if (!(next > low && next < high) || std::abs(next - x) > 0.5 * last_step) {
      next = 0.5 * (low + high);
    }
    last_step = std::abs(next - x);
    x = next;
    if (last_step <= tolerance) return x;
  }
  return x;
}

// The roots within -1 .. 1 of a polynomial (the constant first), ascending, those of even
// multiplicity left out; returns how many. The roots of a derivative part the line into intervals
// in which there is at most one root of what it is the derivative of.
template <int kDegree>
int RootsWithinOne(const double* coefficients, std::array<double, kDegree>* roots) {
  // Derivatives, each divided by a factorial.
  std::array<std::array<double, kDegree + 1>, kDegree> derivatives;
  for (int i = 0; i <= kDegree; ++i) derivatives[0][static_cast<std::size_t>(i)] = coefficients[i];
  for (std::size_t d = 1; d < kDegree; ++d) {
    for (std::size_t i = 0; i + d <= kDegree; ++i) {
      derivatives[d][i] =
          derivatives[d - 1][i + 1] * static_cast<double>(i + 1) / static_cast<double>(d);
    }
  }
  std::array<double, kDegree> parts{};  // Roots of the derivative before.
  int num = 0;
  for (int degree = 1; degree <= kDegree; ++degree) {
    const double* polynomial = derivatives[static_cast<std::size_t>(kDegree - degree)].data();
    const double tolerance = degree < kDegree ? 1e-7 : 1e-14;
    std::array<double, kDegree> found{};
    int num_found = 0;
    double low = -1;
    bool is_negative = Evaluate(polynomial, degree, low) < 0;
    for (int i = 0; i <= num; ++i) {
      const double high = i < num ? parts[static_cast<std::size_t>(i)] : 1;
      const bool is_negative_at_high = Evaluate(polynomial, degree, high) < 0;
      if (is_negative != is_negative_at_high) {
        found[static_cast<std::size_t>(num_found++)] =
            RootBetween(polynomial, degree, low, high, is_negative, tolerance);
      }
      low = high;
      is_negative = is_negative_at_high;
    }
    parts = found;
    num = num_found;
  }
  *roots = parts;
  return num;
}

// The real roots of a polynomial (the constant first), those of even multiplicity left out; returns
// how many. None if a coefficient is not finite.
template <int kDegree>
int RealRoots(const double* coefficients, std::array<double, kDegree>* roots) {
  double reversed[kDegree + 1];
  double sum = 0;
  for (int i = 0; i <= kDegree; ++i) {
    reversed[i] = coefficients[kDegree - i];
    sum += std::abs(coefficients[i]);
  }
  if (!std::isfinite(sum)) return 0;
  int num = RootsWithinOne<kDegree>(coefficients, roots);
  // Those outside are the inverses of those of the reversed polynomial.
  std::array<double, kDegree> inverses{};
  const int num_inverses = RootsWithinOne<kDegree>(reversed, &inverses);
  for (int i = 0; i < num_inverses && num < kDegree; ++i) {
    const double inverse = inverses[static_cast<std::size_t>(i)];
    if (std::abs(inverse) < 1 && inverse != 0) {
      (*roots)[static_cast<std::size_t>(num++)] = 1 / inverse;
    }
  }
  return num;
}

}  // namespace colmap_graphmatch
