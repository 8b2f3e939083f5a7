#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/geometry/minimal_solvers.h"
#include "colmap_graphmatch/geometry/polynomial.h"
#include "colmap_graphmatch/geometry/robust_estimator.h"
#include "colmap_graphmatch/geometry/scoring.h"
#include "tests/support/synthetic_views.h"

namespace colmap_graphmatch {
namespace {

// The formulae of scoring.h, one match after the other, in double precision.
double PlainSquaredError(ErrorKind kind, const Eigen::Matrix3d& model, const PointPair& pair) {
  const Eigen::Vector3d x1(pair.x1, pair.y1, 1);
  const Eigen::Vector3d x2(pair.x2, pair.y2, 1);
  if (kind == ErrorKind::kHomography) {
    return ((model * x1).hnormalized() - x2.hnormalized()).squaredNorm();
  }
  const Eigen::Vector3d line2 = model * x1;
  const Eigen::Vector3d line1 = model.transpose() * x2;
  const double numerator = x2.dot(line2);
  return numerator * numerator / (line2.head<2>().squaredNorm() + line1.head<2>().squaredNorm());
}

std::size_t PlainCount(ErrorKind kind, const Eigen::Matrix3d& model,
                       const std::vector<PointPair>& pairs, double max_squared_error) {
  return static_cast<std::size_t>(
      std::count_if(pairs.begin(), pairs.end(), [&](const PointPair& pair) {
        return PlainSquaredError(kind, model, pair) <= max_squared_error;
      }));
}

std::vector<PointPair> Rows(const PointPairs& pairs) {
  std::vector<PointPair> rows;
  for (std::size_t i = 0; i < pairs.Num(); ++i) rows.push_back(pairs.Row(i));
  return rows;
}

TEST(Polynomial, CubicRootsAreThoseThatTheCubicWasMadeFrom) {
  Random random({1});
  for (int i = 0; i < 1000; ++i) {
    std::array<double, 3> expected{};
    for (double& root : expected) root = 4 * random.Uniform() - 2;
    std::sort(expected.begin(), expected.end());
    const auto [p, q, r] = expected;
    std::array<double, 3> roots{};
    ASSERT_EQ(CubicRoots(-p - q - r, p * q + q * r + r * p, -p * q * r, &roots), 3);
    std::sort(roots.begin(), roots.end());
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(roots[k], expected[k], 1e-4);
  }
}

TEST(Polynomial, CubicWithOneRealRoot) {
  std::array<double, 3> roots{};
  ASSERT_EQ(CubicRoots(-3, 4, -12, &roots), 1);  // (x - 3) (x^2 + 4)
  EXPECT_NEAR(roots[0], 3, 1e-12);
  ASSERT_EQ(CubicRoots(0, 0, 0, &roots), 3);
  EXPECT_EQ(roots[1], 0);
  EXPECT_EQ(CubicRoots(std::nan(""), 0, 0, &roots), 0);
}

TEST(Polynomial, RealRootsAreThoseThatThePolynomialWasMadeFrom) {
  Random random({4});
  for (int i = 0; i < 1000; ++i) {
    // Some real roots, from all of the line, and pairs of others.
    std::vector<double> expected;
    std::vector<double> polynomial = {1};
    const auto multiply = [&](std::initializer_list<double> factor) {
      std::vector<double> product(polynomial.size() + factor.size() - 1);
      for (std::size_t a = 0; a < polynomial.size(); ++a) {
        for (std::size_t b = 0; b < factor.size(); ++b) {
          product[a + b] += polynomial[a] * factor.begin()[b];
        }
      }
      polynomial = product;
    };
    const std::size_t num_real = 2 * random.Index(6);
    while (expected.size() < num_real) {
      const double root = std::tan(3 * (random.Uniform() - 0.5));
      const auto is_near = [&](double other) { return std::abs(other - root) < 0.05; };
      if (std::any_of(expected.begin(), expected.end(), is_near)) continue;
      expected.push_back(root);
      multiply({-root, 1});
    }
    while (polynomial.size() < 11) {
      const double real = 2 * random.Uniform() - 1;
      const double imaginary = 0.2 + random.Uniform();
      multiply({real * real + imaginary * imaginary, -2 * real, 1});
    }
    std::array<double, 10> roots{};
    const int num = RealRoots<10>(polynomial.data(), &roots);
    ASSERT_EQ(static_cast<std::size_t>(num), expected.size());
    std::sort(roots.begin(), roots.begin() + num);
    std::sort(expected.begin(), expected.end());
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_NEAR(roots[k], expected[k], 1e-4 * (1 + std::abs(expected[k])));
    }
  }
}

TEST(Polynomial, HopelessPolynomialsHaveNoRoots) {
  std::array<double, 10> roots{};
  std::array<double, 11> polynomial{};
  EXPECT_EQ(RealRoots<10>(polynomial.data(), &roots), 0);
  polynomial[3] = std::nan("");
  EXPECT_EQ(RealRoots<10>(polynomial.data(), &roots), 0);
  polynomial[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(RealRoots<10>(polynomial.data(), &roots), 0);
}

// Of a model of length 1, whatever its sign.
double DistanceToTruth(const Eigen::Matrix3d& model, const SyntheticViews& views) {
  const Eigen::Matrix3d truth = views.Essential().normalized();
  return std::min((model - truth).norm(), (model + truth).norm());
}

TEST(Fundamental, SevenPointsGiveTheModelThatTheyWereMadeBy) {
  int num_found = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const SyntheticViews views(SyntheticScene::kGeneral, kFundamentalSample, 0, 0, seed);
    std::array<PointPair, kFundamentalSample> sample;
    for (std::size_t i = 0; i < sample.size(); ++i) sample[i] = views.Normalized(views.pairs[i]);
    MinimalModels models;
    SolveFundamental(sample, &models);
    ASSERT_GE(models.num, 1U);
    double least = 1;
    for (std::size_t m = 0; m < models.num; ++m) {
      const Eigen::Matrix3d model = models.models[m].normalized();
      EXPECT_NEAR(model.determinant(), 0, 1e-9);
      for (const PointPair& pair : sample) {
        EXPECT_NEAR(PlainSquaredError(ErrorKind::kEpipolar, model, pair), 0, 1e-16);
      }
      least = std::min(least, DistanceToTruth(model, views));
    }
    if (least < 1e-6) ++num_found;
  }
  EXPECT_GE(num_found, 198);  // Some samples are nearly degenerate.
}

TEST(Essential, FivePointsGiveTheModelThatTheyWereMadeBy) {
  int num_found = 0;
  int num_models = 0;
  int num_inexact = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    const SyntheticViews views(SyntheticScene::kGeneral, kEssentialSample, 0, 0, seed);
    std::array<PointPair, kEssentialSample> sample;
    for (std::size_t i = 0; i < sample.size(); ++i) sample[i] = views.Normalized(views.pairs[i]);
    MinimalModels models;
    SolveEssential(sample, &models);
    double least = 1;
    for (std::size_t m = 0; m < models.num; ++m) {
      const Eigen::Matrix3d model = models.models[m].normalized();
      ++num_models;
      const Eigen::Matrix3d square = model * model.transpose();
      // Roots that nearly coincide cost digits.
      if ((2 * square * model - square.trace() * model).norm() > 1e-6 ||
          std::abs(model.determinant()) > 1e-6) {
        ++num_inexact;
      }
      for (const PointPair& pair : sample) {
        EXPECT_NEAR(PlainSquaredError(ErrorKind::kEpipolar, model, pair), 0, 1e-14);
      }
      least = std::min(least, DistanceToTruth(model, views));
    }
    if (least < 1e-5) ++num_found;
  }
  EXPECT_GE(num_found, 495);  // Some samples are nearly degenerate.
  EXPECT_LT(100 * num_inexact, num_models);
}

TEST(Homography, FourPointsGiveTheModelThatTheyWereMadeBy) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const SyntheticViews views(SyntheticScene::kPlane, kHomographySample, 0, 0, seed);
    std::array<PointPair, kHomographySample> sample;
    for (std::size_t i = 0; i < sample.size(); ++i) sample[i] = views.Normalized(views.pairs[i]);
    MinimalModels models;
    SolveHomography(sample, &models);
    ASSERT_EQ(models.num, 1U);
    for (const PointPair& pair : sample) {
      EXPECT_NEAR(PlainSquaredError(ErrorKind::kHomography, models.models[0], pair), 0, 1e-12);
    }
  }
}

TEST(Scoring, CountsAsThePlainFormulaeDo) {
  Random random({2});
  for (const std::size_t num : {0, 1, 7, 15, 16, 17, 33, 64, 65, 500}) {
    const SyntheticViews views(SyntheticScene::kGeneral, num, 1, 0.3, num);
    const PointPairs pairs(views.pairs);
    for (const ErrorKind kind : {ErrorKind::kEpipolar, ErrorKind::kHomography}) {
      for (int i = 0; i < 20; ++i) {
        Eigen::Matrix3d model = Eigen::Matrix3d::Identity();
        for (double& entry : model.reshaped()) entry += 0.3 * (random.Uniform() - 0.5);
        constexpr double kMaxSquaredError = 0.01;
        const std::size_t expected = PlainCount(kind, model, Rows(pairs), kMaxSquaredError);
        EXPECT_EQ(CountInliers(kind, pairs, model, kMaxSquaredError, 0), expected);
        EXPECT_EQ(CountInliers(kind, pairs, model, kMaxSquaredError, expected), expected);
        EXPECT_EQ(CountInliers(kind, pairs, model, kMaxSquaredError, expected + 1), 0U);
        NormalEquations equations;
        ComputeNormalEquations(kind, pairs, model.normalized(), kMaxSquaredError, &equations);
        EXPECT_EQ(equations.num_inliers, expected);
      }
    }
  }
}

// The sums of the matches that fit, differentiated numerically.
TEST(Scoring, NormalEquationsAreThoseOfNumericalDerivatives) {
  for (const ErrorKind kind : {ErrorKind::kEpipolar, ErrorKind::kHomography}) {
    const SyntheticViews views(
        kind == ErrorKind::kEpipolar ? SyntheticScene::kGeneral : SyntheticScene::kPlane, 100, 2,
        0.2, 5);
    const PointPairs pairs(views.pairs);
    RobustProblem problem;
    problem.kind = kind == ErrorKind::kEpipolar ? ModelKind::kFundamental : ModelKind::kHomography;
    problem.max_error = 6;
    Random random({3});
    const RobustModel estimate = EstimateRobustly(problem, pairs, &random);
    const Eigen::Matrix3d t1 = pairs.Transform1().inverse();
    Eigen::Matrix3d model =
        kind == ErrorKind::kEpipolar
            ? Eigen::Matrix3d(pairs.Transform2().inverse().transpose() * estimate.model * t1)
            : Eigen::Matrix3d(pairs.Transform2() * estimate.model * t1);
    // Away from where the derivatives vanish.
    for (double& entry : model.reshaped()) entry += 2e-3 * model.norm() * (random.Uniform() - 0.5);
    model.normalize();
    const double max_squared_error = std::pow(6 / pairs.Scale(), 2);
    std::vector<PointPair> inliers;
    for (const PointPair& pair : Rows(pairs)) {
      if (PlainSquaredError(kind, model, pair) <= max_squared_error) inliers.push_back(pair);
    }
    const auto loss = [&](const Eigen::Matrix3d& at) {
      double sum = 0;
      for (const PointPair& pair : inliers) sum += PlainSquaredError(kind, at, pair);
      return sum;
    };
    NormalEquations equations;
    ComputeNormalEquations(kind, pairs, model, max_squared_error, &equations);
    ASSERT_EQ(equations.num_inliers, inliers.size());
    EXPECT_NEAR(equations.sum_squared, loss(model), 1e-5 * loss(model));
    const double scale = equations.jtr.norm();
    for (int i = 0; i < 9; ++i) {
      constexpr double kStep = 1e-6;
      Eigen::Matrix3d more = model;
      Eigen::Matrix3d less = model;
      more(i / 3, i % 3) += kStep;
      less(i / 3, i % 3) -= kStep;
      EXPECT_NEAR(equations.jtr(i), (loss(more) - loss(less)) / (4 * kStep), 2e-3 * scale) << i;
    }
    EXPECT_LT((equations.jtj - equations.jtj.transpose()).norm(), 1e-12);
    // The model's own direction changes nothing.
    Eigen::Matrix<double, 9, 1> entries;
    for (int i = 0; i < 9; ++i) entries(i) = model(i / 3, i % 3);
    EXPECT_LT((equations.jtj * entries).norm(), 1e-4 * equations.jtj.norm());
  }
}

struct Case {
  SyntheticScene scene;
  double outliers;
};

TEST(Robust, FundamentalFindsTheInliersAmongAnyNumberOfOutliers) {
  for (const double outliers : {0.0, 0.2, 0.5, 0.7}) {
    for (const SyntheticScene scene :
         {SyntheticScene::kGeneral, SyntheticScene::kForward, SyntheticScene::kTranslation}) {
      for (std::uint64_t seed = 0; seed < 5; ++seed) {
        const SyntheticViews views(scene, 200, 0.5, outliers, seed);
        RobustProblem problem;
        problem.max_error = 4;
        problem.budget.max_num_trials = 100000;
        Random random({seed});
        const PointPairs pairs(views.pairs);
        const RobustModel estimate = EstimateRobustly(problem, pairs, &random);
        EXPECT_GE(estimate.num_inliers + 3, views.num_inliers);
        EXPECT_LE(estimate.num_trials, 100000U);
        EXPECT_EQ(estimate.num_inliers,
                  PlainCount(ErrorKind::kEpipolar, estimate.model, views.pairs, 16));
      }
    }
  }
}

TEST(Robust, EssentialFindsTheInliersAmongAnyNumberOfOutliers) {
  for (const double outliers : {0.0, 0.3, 0.6, 0.8}) {
    for (const SyntheticScene scene : {SyntheticScene::kGeneral, SyntheticScene::kForward,
                                       SyntheticScene::kTranslation, SyntheticScene::kPlane}) {
      for (std::uint64_t seed = 0; seed < 3; ++seed) {
        const SyntheticViews views(scene, 200, 0.5, outliers, seed);
        std::vector<PointPair> normalized;
        for (const PointPair& pair : views.pairs) {
          normalized.push_back(SyntheticViews::Normalized(pair));
        }
        RobustProblem problem;
        problem.kind = ModelKind::kEssential;
        problem.max_error = 4 / SyntheticViews::kFocalLength;
        problem.budget.max_num_trials = 20000;
        Random random({seed});
        const RobustModel estimate = EstimateRobustly(problem, PointPairs(normalized), &random);
        EXPECT_GE(estimate.num_inliers + 3, views.num_inliers);
        // Two equal singular values, and none.
        const Eigen::Matrix3d model = estimate.model.normalized();
        const Eigen::Matrix3d square = model * model.transpose();
        EXPECT_LT((2 * square * model - square.trace() * model).norm(), 1e-9);
        // All but a match on the very threshold.
        const std::size_t plain =
            PlainCount(ErrorKind::kEpipolar, model, normalized, std::pow(problem.max_error, 2));
        EXPECT_LE(plain, estimate.num_inliers + 1);
        EXPECT_LE(estimate.num_inliers, plain + 1);
      }
    }
  }
}

// Points on a plane fit a family of fundamental matrices; one of them is found.
TEST(Robust, FundamentalOfAPlaneOrATurn) {
  for (const SyntheticScene scene : {SyntheticScene::kPlane, SyntheticScene::kRotation}) {
    for (const double outliers : {0.0, 0.5}) {
      const SyntheticViews views(scene, 200, 0.5, outliers, 1);
      RobustProblem problem;
      problem.max_error = 4;
      Random random({1});
      const RobustModel estimate = EstimateRobustly(problem, PointPairs(views.pairs), &random);
      EXPECT_GE(estimate.num_inliers + 2, views.num_inliers);
    }
  }
}

TEST(Robust, FewPoints) {
  for (std::size_t num = 0; num <= 20; ++num) {
    const SyntheticViews views(SyntheticScene::kGeneral, num, 0.2, 0, num);
    RobustProblem problem;
    problem.max_error = 4;
    Random random({num});
    const RobustModel estimate = EstimateRobustly(problem, PointPairs(views.pairs), &random);
    if (num < 7) {
      EXPECT_EQ(estimate.num_inliers, 0U);
      EXPECT_EQ(estimate.num_trials, 0U);
    } else {
      EXPECT_EQ(estimate.num_inliers, num);
    }
  }
}

TEST(Robust, HomographyFindsPlanesAndRotations) {
  for (const double outliers : {0.0, 0.5, 0.8, 0.95}) {
    for (const SyntheticScene scene : {SyntheticScene::kPlane, SyntheticScene::kRotation}) {
      for (std::uint64_t seed = 0; seed < 5; ++seed) {
        const SyntheticViews views(scene, 400, 0.5, outliers, seed);
        RobustProblem problem;
        problem.kind = ModelKind::kHomography;
        problem.max_error = 4;
        problem.budget.max_num_trials = 2000000;
        Random random({seed});
        const PointPairs pairs(views.pairs);
        const RobustModel estimate = EstimateRobustly(problem, pairs, &random);
        EXPECT_GE(estimate.num_inliers + 2, views.num_inliers);
        EXPECT_EQ(estimate.num_inliers,
                  PlainCount(ErrorKind::kHomography, estimate.model, views.pairs, 16));
      }
    }
  }
}

TEST(Robust, HopelessInputGivesNoModelOrAPoorOne) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const ModelKind kind :
       {ModelKind::kFundamental, ModelKind::kEssential, ModelKind::kHomography}) {
    RobustProblem problem;
    problem.kind = kind;
    problem.max_error = 4;
    problem.budget.max_num_trials = 500;
    Random random({1});
    const auto estimate = [&](const std::vector<PointPair>& pairs) {
      return EstimateRobustly(problem, PointPairs(pairs), &random).num_inliers;
    };
    EXPECT_EQ(estimate({}), 0U);
    EXPECT_EQ(estimate({{1, 2, 3, 4}}), 0U);
    EXPECT_EQ(estimate(std::vector<PointPair>(20, {kNan, 1, 2, 3})), 0U);
    EXPECT_EQ(estimate(std::vector<PointPair>(20, {1, kInfinity, 2, 3})), 0U);
    EXPECT_EQ(estimate(std::vector<PointPair>(20, {1, 2, 1e30, 3})), 0U);
    estimate(std::vector<PointPair>(20, {1, 2, 3, 4}));
    std::vector<PointPair> line;
    for (int i = 0; i < 30; ++i) line.push_back({10.0 * i, 5, 3.0 * i, 7.0 * i});
    estimate(line);
  }
}

TEST(Robust, NumTrialsAreColmaps) {
  const TrialBudget budget;
  EXPECT_EQ(NumTrials(100, 100, 7, budget), 1U);
  EXPECT_EQ(NumTrials(0, 100, 7, budget), 10000U);
  // ceil(3 log(0.001) / log(1 - 0.5^4))
  EXPECT_EQ(NumTrials(50, 100, 4, budget), 322U);
  EXPECT_EQ(NumTrials(50, 100, 7, budget), 2643U);
}

}  // namespace
}  // namespace colmap_graphmatch
