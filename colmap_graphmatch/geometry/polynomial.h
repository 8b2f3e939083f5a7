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

// A polynomial by its coefficients of Bernstein: it has at most as many roots in the interval as
// they have changes of sign, and one root if there is one change.
template <int kDegree>
using Bernstein = std::array<double, kDegree + 1>;

// On -1 .. 1.
template <int kDegree>
Bernstein<kDegree> ToBernstein(const double* coefficients) {
  static const auto table = [] {
    std::array<std::array<double, kDegree + 1>, kDegree + 1> choose{};
    for (std::size_t n = 0; n <= kDegree; ++n) {
      choose[n][0] = choose[n][n] = 1;
      for (std::size_t k = 1; k < n; ++k) choose[n][k] = choose[n - 1][k - 1] + choose[n - 1][k];
    }
    // Of x^k with x = 2 t - 1: the mean of the products of k of n factors, j of which are 1 and the
    // others -1.
    std::array<std::array<double, kDegree + 1>, kDegree + 1> powers{};
    for (std::size_t j = 0; j <= kDegree; ++j) {
      for (std::size_t k = 0; k <= kDegree; ++k) {
        double sum = 0;
        for (std::size_t i = 0; i <= k; ++i) {
          if (i > j || k - i > kDegree - j) continue;
          sum += ((k - i) % 2 == 0 ? 1 : -1) * choose[j][i] * choose[kDegree - j][k - i];
        }
        powers[k][j] = sum / choose[kDegree][k];
      }
    }
    return powers;
  }();
  Bernstein<kDegree> result{};
  for (std::size_t k = 0; k <= kDegree; ++k) {
    for (std::size_t j = 0; j <= kDegree; ++j) result[j] += table[k][j] * coefficients[k];
  }
  return result;
}

template <int kDegree>
int SignChanges(const Bernstein<kDegree>& bernstein) {
  int num = 0;
  for (std::size_t i = 0; i < kDegree; ++i) {
    num += static_cast<int>((bernstein[i] < 0) != (bernstein[i + 1] < 0));
  }
  return num;
}

// Adds the roots within low .. high to *num ones.
template <int kDegree>
void AddRoots(const double* coefficients, Bernstein<kDegree> right, double low, double high,
              int depth, std::array<double, kDegree>* roots, int* num) {
  constexpr double kTolerance = 1e-14;
  const int changes = SignChanges<kDegree>(right);
  if (changes == 0 || *num == kDegree) return;
  if (changes == 1) {
    (*roots)[static_cast<std::size_t>((*num)++)] =
        RootBetween(coefficients, kDegree, low, high, right[0] < 0, kTolerance);
    return;
  }
  if (depth == 0) return;
  // In two by de Casteljau, not in the middle: where roots are regular, one may be there.
  constexpr double kPart = 0.53;
  Bernstein<kDegree> left{};
  for (std::size_t step = 0; step <= kDegree; ++step) {
    left[step] = right[0];
    for (std::size_t i = 0; i + step < kDegree; ++i) {
      right[i] += kPart * (right[i + 1] - right[i]);
    }
  }
  const double middle = low + kPart * (high - low);
  AddRoots<kDegree>(coefficients, left, low, middle, depth - 1, roots, num);
  AddRoots<kDegree>(coefficients, right, middle, high, depth - 1, roots, num);
}

// The roots within -1 .. 1 of a polynomial (the constant first), ascending, those of even
// multiplicity and those that coincide but for some 1e-7 left out; returns how many.
template <int kDegree>
int RootsWithinOne(const double* coefficients, std::array<double, kDegree>* roots) {
  constexpr int kMaxDepth = 24;
  int num = 0;
  AddRoots<kDegree>(coefficients, ToBernstein<kDegree>(coefficients), -1, 1, kMaxDepth, roots,
                    &num);
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
