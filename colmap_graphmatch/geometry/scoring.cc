#include "colmap_graphmatch/geometry/scoring.h"

#include <algorithm>
#include <array>

// Highway compiles this file once for each instruction set and picks one when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "colmap_graphmatch/geometry/scoring.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace colmap_graphmatch {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The lines of a match: F x1 in image 2, and the first two entries of F^T x2; N = x2^T F x1, and
// D, the squared length of N's gradient. The squared Sampson error is N^2 / D.
template <class V>
struct EpipolarTerms {
  V a2, b2, a1, b1, numerator, denominator;
};

// Rows from i on, as many as there are lanes.
template <class V>
struct Rows {
  V x1, y1, x2, y2;
};
template <class D>
HWY_INLINE Rows<hn::Vec<D>> Load(D d, const PointColumns& columns, std::size_t i) {
  return {hn::LoadU(d, columns.x1 + i), hn::LoadU(d, columns.y1 + i), hn::LoadU(d, columns.x2 + i),
          hn::LoadU(d, columns.y2 + i)};
}

// A model, each entry in all lanes of a vector.
template <class D>
struct Model {
  using V = hn::Vec<D>;
  V m00, m01, m02, m10, m11, m12, m20, m21, m22;

  HWY_INLINE Model(D d, const float* m)
      : m00(hn::Set(d, m[0])),
        m01(hn::Set(d, m[1])),
        m02(hn::Set(d, m[2])),
        m10(hn::Set(d, m[3])),
        m11(hn::Set(d, m[4])),
        m12(hn::Set(d, m[5])),
        m20(hn::Set(d, m[6])),
        m21(hn::Set(d, m[7])),
        m22(hn::Set(d, m[8])) {}

  // a x + b y + c
  static HWY_INLINE V Affine(V a, V b, V c, V x, V y) {
    return hn::Add(hn::Add(hn::Mul(a, x), hn::Mul(b, y)), c);
  }

  HWY_INLINE EpipolarTerms<V> Epipolar(V x1, V y1, V x2, V y2) const {
    EpipolarTerms<V> terms;
    terms.a2 = Affine(m00, m01, m02, x1, y1);
    terms.b2 = Affine(m10, m11, m12, x1, y1);
    terms.a1 = Affine(m00, m10, m20, x2, y2);
    terms.b1 = Affine(m01, m11, m21, x2, y2);
    terms.numerator = Affine(terms.a2, terms.b2, Affine(m20, m21, m22, x1, y1), x2, y2);
    terms.denominator = hn::Add(hn::Add(hn::Mul(terms.a2, terms.a2), hn::Mul(terms.b2, terms.b2)),
                                hn::Add(hn::Mul(terms.a1, terms.a1), hn::Mul(terms.b1, terms.b1)));
    return terms;
  }

  // Which lanes fit.
  HWY_INLINE hn::Mask<D> FitsEpipolar(V x1, V y1, V x2, V y2, V max_squared_error) const {
    const EpipolarTerms<V> terms = Epipolar(x1, y1, x2, y2);
    return hn::Le(hn::Mul(terms.numerator, terms.numerator),
                  hn::Mul(max_squared_error, terms.denominator));
  }

  HWY_INLINE hn::Mask<D> FitsHomography(V x1, V y1, V x2, V y2, V max_squared_error) const {
    const V w = Affine(m20, m21, m22, x1, y1);
    const V dx = hn::Sub(hn::Mul(x2, w), Affine(m00, m01, m02, x1, y1));
    const V dy = hn::Sub(hn::Mul(y2, w), Affine(m10, m11, m12, x1, y1));
    return hn::Le(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)),
                  hn::Mul(max_squared_error, hn::Mul(w, w)));
  }
};

template <ErrorKind kKind>
std::size_t CountFitting(const PointColumns& columns, std::size_t num, std::size_t num_padded,
                         const float* entries, float max_squared_error, std::size_t num_needed) {
  // A vector of AVX-512 has as many lanes as the columns are padded to.
  const hn::CappedTag<float, PointPairs::kPadding> d;
  const Model<decltype(d)> model(d, entries);
  const auto max_error = hn::Set(d, max_squared_error);
  const std::size_t lanes = hn::Lanes(d);
  if (num < num_needed) return 0;
  const std::size_t max_misses = num - num_needed;
  // Between two looks at the misses.
  constexpr std::size_t kStep = 2 * PointPairs::kPadding;
  std::size_t count = 0;
  for (std::size_t begin = 0; begin < num_padded; begin += kStep) {
    const std::size_t end = std::min(begin + kStep, num_padded);
    for (std::size_t i = begin; i < end; i += lanes) {
      const auto [x1, y1, x2, y2] = Load(d, columns, i);
      if constexpr (kKind == ErrorKind::kEpipolar) {
        count += hn::CountTrue(d, model.FitsEpipolar(x1, y1, x2, y2, max_error));
      } else {
        count += hn::CountTrue(d, model.FitsHomography(x1, y1, x2, y2, max_error));
      }
    }
    if (std::min(end, num) > count + max_misses) return 0;
  }
  return count >= num_needed ? count : 0;
}

std::size_t CountInliersOnTarget(ErrorKind kind, const PointColumns& columns, std::size_t num,
                                 std::size_t num_padded, const float* model,
                                 float max_squared_error, std::size_t num_needed) {
  return kind == ErrorKind::kEpipolar
             ? CountFitting<ErrorKind::kEpipolar>(columns, num, num_padded, model,
                                                  max_squared_error, num_needed)
             : CountFitting<ErrorKind::kHomography>(columns, num, num_padded, model,
                                                    max_squared_error, num_needed);
}

// Rows whose derivatives are kept at a time.
constexpr std::size_t kBlock = 64;
static_assert(kBlock % PointPairs::kPadding == 0);

// The columns that sums are formed in.
constexpr std::size_t kSums = 8;

// products[i][j] += the dot product of columns i and j >= i. A column has num rows, a multiple of
// kPadding.
template <std::size_t kColumns>
void AddProducts(const float (*values)[kBlock], std::size_t num,
                 double (&products)[kColumns][kColumns]) {
  const hn::CappedTag<float, kSums> d;
  constexpr std::size_t kLanes = hn::MaxLanes(d);
  constexpr std::size_t kVectors = kSums / kLanes;
  for (std::size_t i = 0; i < kColumns; ++i) {
    for (std::size_t j = i; j < kColumns; ++j) {
      hn::Vec<decltype(d)> sums[kVectors];
      for (std::size_t v = 0; v < kVectors; ++v) sums[v] = hn::Zero(d);
      for (std::size_t row = 0; row < num; row += kSums) {
        for (std::size_t v = 0; v < kVectors; ++v) {
          const std::size_t at = row + v * kLanes;
          sums[v] =
              hn::Add(sums[v], hn::Mul(hn::LoadU(d, values[i] + at), hn::LoadU(d, values[j] + at)));
        }
      }
      float lanes[kSums];
      for (std::size_t v = 0; v < kVectors; ++v) hn::StoreU(sums[v], d, lanes + v * kLanes);
      products[i][j] += static_cast<double>(((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) +
                                            ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7])));
    }
  }
}

// The residual and its derivatives, all zero where a match does not fit:
//   r = N / sqrt(D),  dr / dF_ij = (x2_i x1_j - N / D (1/2 dD / dF_ij)) / sqrt(D),
//   1/2 dD / dF_ij = [i < 2] (F x1)_i x1_j + [j < 2] (F^T x2)_j x2_i.
constexpr std::size_t kEpipolarColumns = 10;
std::size_t EpipolarRows(const PointColumns& columns, std::size_t num, const float* entries,
                         float max_squared_error, float (*values)[kBlock]) {
  const hn::CappedTag<float, PointPairs::kPadding> d;
  const Model<decltype(d)> model(d, entries);
  const auto max_error = hn::Set(d, max_squared_error);
  const auto zero = hn::Zero(d);
  const auto one = hn::Set(d, 1.0F);
  std::size_t count = 0;
  for (std::size_t i = 0; i < num; i += hn::Lanes(d)) {
    const auto [x1, y1, x2, y2] = Load(d, columns, i);
    const auto terms = model.Epipolar(x1, y1, x2, y2);
    const auto fits =
        hn::Le(hn::Mul(terms.numerator, terms.numerator), hn::Mul(max_error, terms.denominator));
    count += hn::CountTrue(d, fits);
    const auto used = hn::And(fits, hn::Gt(terms.denominator, zero));
    const auto denominator = hn::IfThenElse(used, terms.denominator, one);
    const auto s = hn::IfThenElseZero(used, hn::Div(one, hn::Sqrt(denominator)));
    const auto e = hn::Div(terms.numerator, denominator);
    const auto p = hn::Sub(x2, hn::Mul(e, terms.a2));
    const auto q = hn::Sub(y2, hn::Mul(e, terms.b2));
    const auto a = hn::Mul(e, terms.a1);
    const auto b = hn::Mul(e, terms.b1);
    const auto store = [&](std::size_t column, auto value) {
      // Zero, not zero times something: that could be NaN.
      hn::StoreU(hn::IfThenElseZero(used, hn::Mul(s, value)), d, values[column] + i);
    };
    store(0, hn::Sub(hn::Mul(p, x1), hn::Mul(a, x2)));
    store(1, hn::Sub(hn::Mul(p, y1), hn::Mul(b, x2)));
    store(2, p);
    store(3, hn::Sub(hn::Mul(q, x1), hn::Mul(a, y2)));
    store(4, hn::Sub(hn::Mul(q, y1), hn::Mul(b, y2)));
    store(5, q);
    store(6, hn::Sub(x1, a));
    store(7, hn::Sub(y1, b));
    store(8, one);
    store(9, terms.numerator);
  }
  return count;
}

// u = x1 / w; v and t, the derivatives of both residuals by the last row; the residuals.
constexpr std::size_t kHomographyColumns = 11;
std::size_t HomographyRows(const PointColumns& columns, std::size_t num, const float* entries,
                           float max_squared_error, float (*values)[kBlock]) {
  const hn::CappedTag<float, PointPairs::kPadding> d;
  const Model<decltype(d)> model(d, entries);
  const auto max_error = hn::Set(d, max_squared_error);
  const auto one = hn::Set(d, 1.0F);
  std::size_t count = 0;
  for (std::size_t i = 0; i < num; i += hn::Lanes(d)) {
    const auto [x1, y1, x2, y2] = Load(d, columns, i);
    const auto fits = model.FitsHomography(x1, y1, x2, y2, max_error);
    count += hn::CountTrue(d, fits);
    const auto w = model.Affine(model.m20, model.m21, model.m22, x1, y1);
    const auto used = hn::And(fits, hn::Ne(w, hn::Zero(d)));
    const auto inverse = hn::Div(one, hn::IfThenElse(used, w, one));
    const auto px = hn::Mul(model.Affine(model.m00, model.m01, model.m02, x1, y1), inverse);
    const auto py = hn::Mul(model.Affine(model.m10, model.m11, model.m12, x1, y1), inverse);
    const auto store = [&](std::size_t column, auto value) {
      hn::StoreU(hn::IfThenElseZero(used, value), d, values[column] + i);
    };
    const auto ux = hn::Mul(x1, inverse);
    const auto uy = hn::Mul(y1, inverse);
    store(0, ux);
    store(1, uy);
    store(2, inverse);
    store(3, hn::Neg(hn::Mul(px, ux)));
    store(4, hn::Neg(hn::Mul(px, uy)));
    store(5, hn::Neg(hn::Mul(px, inverse)));
    store(6, hn::Neg(hn::Mul(py, ux)));
    store(7, hn::Neg(hn::Mul(py, uy)));
    store(8, hn::Neg(hn::Mul(py, inverse)));
    store(9, hn::Sub(px, x2));
    store(10, hn::Sub(py, y2));
  }
  return count;
}

void NormalEquationsOnTarget(ErrorKind kind, const PointColumns& columns, std::size_t num_padded,
                             const float* model, float max_squared_error,
                             NormalEquations* equations) {
  HWY_ALIGN float values[kHomographyColumns][kBlock];
  std::size_t count = 0;
  double epipolar[kEpipolarColumns][kEpipolarColumns] = {};
  double homography[kHomographyColumns][kHomographyColumns] = {};
  for (std::size_t begin = 0; begin < num_padded; begin += kBlock) {
    const std::size_t num = std::min(kBlock, num_padded - begin);
    const PointColumns from{columns.x1 + begin, columns.y1 + begin, columns.x2 + begin,
                            columns.y2 + begin};
    if (kind == ErrorKind::kEpipolar) {
      count += EpipolarRows(from, num, model, max_squared_error, values);
      AddProducts(values, num, epipolar);
    } else {
      count += HomographyRows(from, num, model, max_squared_error, values);
      AddProducts(values, num, homography);
    }
  }
  equations->num_inliers = count;
  if (kind == ErrorKind::kEpipolar) {
    for (int i = 0; i < 9; ++i) {
      for (int j = i; j < 9; ++j) equations->jtj(i, j) = equations->jtj(j, i) = epipolar[i][j];
      equations->jtr(i) = epipolar[i][9];
    }
    equations->sum_squared = epipolar[9][9];
    return;
  }
  equations->jtj.setZero();
  const auto product = [&](int i, int j) { return homography[std::min(i, j)][std::max(i, j)]; };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      equations->jtj(i, j) = equations->jtj(3 + i, 3 + j) = product(i, j);
      equations->jtj(i, 6 + j) = equations->jtj(6 + j, i) = product(i, 3 + j);
      equations->jtj(3 + i, 6 + j) = equations->jtj(6 + j, 3 + i) = product(i, 6 + j);
      equations->jtj(6 + i, 6 + j) = product(3 + i, 3 + j) + product(6 + i, 6 + j);
    }
    equations->jtr(i) = product(i, 9);
    equations->jtr(3 + i) = product(i, 10);
    equations->jtr(6 + i) = product(3 + i, 9) + product(6 + i, 10);
  }
  equations->sum_squared = product(9, 9) + product(10, 10);
}

}  // namespace HWY_NAMESPACE
}  // namespace colmap_graphmatch
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace colmap_graphmatch {
namespace {

// The entries, row-major, at a scale that single precision holds.
std::array<float, 9> ToFloats(const Eigen::Matrix3d& model) {
  const double norm = model.norm();
  std::array<float, 9> entries{};
  for (int i = 0; i < 9; ++i) {
    entries[static_cast<std::size_t>(i)] = static_cast<float>(model(i / 3, i % 3) / norm);
  }
  return entries;
}

}  // namespace

HWY_EXPORT(CountInliersOnTarget);
HWY_EXPORT(NormalEquationsOnTarget);

std::size_t CountInliers(ErrorKind kind, const PointPairs& pairs, const Eigen::Matrix3d& model,
                         double max_squared_error, std::size_t num_needed) {
  const std::array<float, 9> entries = ToFloats(model);
  return HWY_DYNAMIC_DISPATCH(CountInliersOnTarget)(
      kind, pairs.Columns(), pairs.Num(), pairs.NumPadded(), entries.data(),
      static_cast<float>(max_squared_error), num_needed);
}

void ComputeNormalEquations(ErrorKind kind, const PointPairs& pairs, const Eigen::Matrix3d& model,
                            double max_squared_error, NormalEquations* equations) {
  const std::array<float, 9> entries = ToFloats(model);
  HWY_DYNAMIC_DISPATCH(NormalEquationsOnTarget)
  (kind, pairs.Columns(), pairs.NumPadded(), entries.data(), static_cast<float>(max_squared_error),
   equations);
}

}  // namespace colmap_graphmatch
#endif
