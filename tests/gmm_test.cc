#include "colmap_graphmatch/encoding/gmm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/encoding/matrix.h"
#include "colmap_graphmatch/encoding/matrix_product.h"
#include "tests/support/reference_encoding.h"

namespace colmap_graphmatch {

class GmmEvaluatorPeer {
 public:
  static RowMatrixXf Responsibilities(const GmmEvaluator& evaluator, const RowMatrixXf& samples) {
    return evaluator.Responsibilities(samples);
  }
};

namespace {

using ::testing::Each;
using ::testing::SizeIs;
using ::testing::Values;
using ::testing::ValuesIn;

// Equal in size and in every entry; NaN equals nothing.
template <typename Derived>
bool ExactlyEqual(const Eigen::MatrixBase<Derived>& a, const Eigen::MatrixBase<Derived>& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && (a.array() == b.array()).all();
}

void ExpectExactlyEqual(const GmmTraining& a, const GmmTraining& b) {
  EXPECT_TRUE(ExactlyEqual(a.mixture.weights, b.mixture.weights));
  EXPECT_TRUE(ExactlyEqual(a.mixture.means, b.mixture.means));
  EXPECT_TRUE(ExactlyEqual(a.mixture.variances, b.mixture.variances));
  EXPECT_EQ(a.log_likelihoods, b.log_likelihoods);
  EXPECT_EQ(a.num_replaced_components, b.num_replaced_components);
  EXPECT_EQ(a.converged, b.converged);
}

// What holds for every mixture that was trained, whatever the samples.
void ExpectValid(const GaussianMixture& mixture, double variance_floor) {
  ASSERT_GE(mixture.NumComponents(), 1);
  ASSERT_EQ(mixture.weights.size(), mixture.NumComponents());
  ASSERT_EQ(mixture.variances.rows(), mixture.NumComponents());
  ASSERT_EQ(mixture.variances.cols(), mixture.Dim());
  EXPECT_TRUE(mixture.weights.allFinite());
  EXPECT_TRUE(mixture.means.allFinite());
  EXPECT_TRUE(mixture.variances.allFinite());
  EXPECT_GT(mixture.weights.minCoeff(), 0);
  EXPECT_NEAR(mixture.weights.sum(), 1, 1e-12);
  EXPECT_GE(mixture.variances.minCoeff(), variance_floor);
}

GmmTraining Train(const GmmOptions& options, const RowMatrixXf& samples, int num_threads = 2,
                  std::uint64_t seed = 0) {
  ThreadPool threads(num_threads);
  return TrainGmm(options, seed, samples, threads);
}

// Exactly `num_iterations` updates.
GmmOptions FixedIterations(int num_components, int num_iterations, double variance_floor = 1e-4) {
  GmmOptions options;
  options.num_components = num_components;
  options.tolerance = 0;
  options.max_num_iterations = num_iterations;
  options.variance_floor = variance_floor;
  return options;
}

// Sizes around the multiples of 16 that matrices are padded to, and numbers of samples around the
// block of 256.
struct Shape {
  Eigen::Index num_components;
  Eigen::Index dim;
  Eigen::Index num_samples;
};

void PrintTo(const Shape& shape, std::ostream* stream) {
  *stream << "K=" << shape.num_components << " D=" << shape.dim << " N=" << shape.num_samples;
}

class GmmEvaluatorTest : public ::testing::TestWithParam<Shape> {
 protected:
  void MakeMixture(double size, double offset) {
    Random random({static_cast<std::uint64_t>(GetParam().dim), 11});
    mixture_ = RandomMixture(GetParam().num_components, GetParam().dim, size, offset, &random);
    samples_ = SampleMixture(mixture_, GetParam().num_samples, &random);
  }

  void ExpectResponsibilitiesOfTheReference(double tolerance) const {
    const RowMatrixXf responsibilities =
        GmmEvaluatorPeer::Responsibilities(GmmEvaluator(mixture_), samples_);
    const RowMatrixXd expected = ReferenceResponsibilities(mixture_, samples_);
    ASSERT_EQ(responsibilities.rows(), expected.rows());
    ASSERT_EQ(responsibilities.cols(), expected.cols());
    EXPECT_LT((responsibilities.cast<double>() - expected).cwiseAbs().maxCoeff(), tolerance);
  }

  GaussianMixture mixture_;
  RowMatrixXf samples_;
};

INSTANTIATE_TEST_SUITE_P(Shapes, GmmEvaluatorTest,
                         Values(Shape{1, 1, 1}, Shape{1, 7, 300}, Shape{3, 5, 257},
                                Shape{2, 8, 255}, Shape{16, 16, 256}, Shape{17, 17, 1000},
                                Shape{20, 128, 600}, Shape{64, 33, 300}));

TEST_P(GmmEvaluatorTest, ResponsibilitiesAreThoseOfTheReference) {
  MakeMixture(2, 0);
  ExpectResponsibilitiesOfTheReference(1e-4);
}

TEST_P(GmmEvaluatorTest, ResponsibilitiesAreAccurateFarFromZero) {
  MakeMixture(2, 1000);
  ExpectResponsibilitiesOfTheReference(1e-4);
}

TEST_P(GmmEvaluatorTest, ResponsibilitiesAreAccurateWhenComponentsAreFarApart) {
  MakeMixture(30, 0);
  ExpectResponsibilitiesOfTheReference(1e-3);
}

TEST_P(GmmEvaluatorTest, ResponsibilitiesSumToOne) {
  MakeMixture(2, 0);
  const RowMatrixXf responsibilities =
      GmmEvaluatorPeer::Responsibilities(GmmEvaluator(mixture_), samples_);
  EXPECT_GE(responsibilities.minCoeff(), 0);
  for (Eigen::Index i = 0; i < responsibilities.rows(); ++i) {
    EXPECT_NEAR(responsibilities.row(i).cast<double>().sum(), 1, 1e-5);
  }
}

TEST_P(GmmEvaluatorTest, StatisticsAreThoseOfTheReference) {
  for (const double offset : {0.0, 1000.0}) {
    MakeMixture(2, offset);
    const Eigen::Index num_components = mixture_.NumComponents();
    const Eigen::Index dim = mixture_.Dim();
    const GmmEvaluator evaluator(mixture_);
    SufficientStatistics sums(num_components, dim);
    evaluator.Accumulate(samples_, &sums);

    ASSERT_EQ(evaluator.Origin().size(), dim);
    const RowMatrixXd responsibilities = ReferenceResponsibilities(mixture_, samples_);
    const auto num_samples = static_cast<double>(samples_.rows());
    for (Eigen::Index k = 0; k < num_components; ++k) {
      double s0 = 0;
      for (Eigen::Index i = 0; i < samples_.rows(); ++i) s0 += responsibilities(i, k);
      EXPECT_NEAR(sums.s0[k], s0, 3e-5 * num_samples);
      for (Eigen::Index d = 0; d < dim; ++d) {
        double s1 = 0;
        double s2 = 0;
        for (Eigen::Index i = 0; i < samples_.rows(); ++i) {
          const double difference = static_cast<double>(samples_(i, d)) - evaluator.Origin()[d];
          s1 += responsibilities(i, k) * difference;
          s2 += responsibilities(i, k) * difference * difference;
        }
        ASSERT_NEAR(sums.s1(k, d), s1, 3e-5 * num_samples) << k << " " << d;
        ASSERT_NEAR(sums.s2(k, d), s2, 1e-4 * num_samples) << k << " " << d;
      }
    }
    EXPECT_NEAR(sums.log_likelihood / num_samples, ReferenceMeanLogLikelihood(mixture_, samples_),
                1e-6 * static_cast<double>(dim) + 1e-6);
  }
}

TEST_P(GmmEvaluatorTest, StatisticsAddUp) {
  MakeMixture(2, 0);
  const GmmEvaluator evaluator(mixture_);
  SufficientStatistics all(mixture_.NumComponents(), mixture_.Dim());
  evaluator.Accumulate(samples_, &all);

  SufficientStatistics twice(mixture_.NumComponents(), mixture_.Dim());
  evaluator.Accumulate(samples_, &twice);
  evaluator.Accumulate(samples_, &twice);
  SufficientStatistics added = all;
  added.Add(all);
  EXPECT_NEAR(twice.log_likelihood, 2 * all.log_likelihood,
              1e-9 * std::abs(all.log_likelihood) + 1e-9);
  EXPECT_TRUE(twice.s0.isApprox(2 * all.s0, 1e-9));
  EXPECT_TRUE(twice.s1.isApprox(2 * all.s1, 1e-9));
  EXPECT_TRUE(twice.s2.isApprox(2 * all.s2, 1e-9));
  EXPECT_EQ(added.log_likelihood, 2 * all.log_likelihood);
  EXPECT_TRUE(ExactlyEqual(added.s0, (2 * all.s0).eval()));
  EXPECT_TRUE(ExactlyEqual(added.s1, (2 * all.s1).eval()));
  EXPECT_TRUE(ExactlyEqual(added.s2, (2 * all.s2).eval()));
}

TEST(GmmEvaluatorFarSampleTest, SamplesFarFromEveryComponentStillBelongToOne) {
  GaussianMixture mixture;
  mixture.weights = Eigen::VectorXd::Constant(2, 0.5);
  mixture.means = RowMatrixXd::Zero(2, 3);
  mixture.means(1, 0) = 1;
  mixture.variances = RowMatrixXd::Constant(2, 3, 1e-4);
  RowMatrixXf samples(2, 3);
  samples << -50, 0, 0, 70, 0, 0;
  const RowMatrixXf responsibilities =
      GmmEvaluatorPeer::Responsibilities(GmmEvaluator(mixture), samples);
  EXPECT_EQ(responsibilities(0, 0), 1);
  EXPECT_EQ(responsibilities(0, 1), 0);
  EXPECT_EQ(responsibilities(1, 0), 0);
  EXPECT_EQ(responsibilities(1, 1), 1);
}

TEST(GmmEvaluatorSiftTest, ResponsibilitiesOfSiftDescriptorsAreThoseOfTheReference) {
  Random random({12});
  const RowMatrixXf samples = SampleSiftLike(2000, &random);
  const GmmTraining training = Train(FixedIterations(20, 5), samples);
  ASSERT_EQ(training.mixture.NumComponents(), 20);
  const RowMatrixXf responsibilities =
      GmmEvaluatorPeer::Responsibilities(GmmEvaluator(training.mixture), samples);
  const RowMatrixXd expected = ReferenceResponsibilities(training.mixture, samples);
  EXPECT_LT((responsibilities.cast<double>() - expected).cwiseAbs().maxCoeff(), 1e-3);
}

// One component is where its samples are, in closed form.
TEST(TrainGmmTest, OneComponentGetsTheMeanAndTheVarianceOfTheSamples) {
  Random random({13});
  const GaussianMixture planted = RandomMixture(3, 5, 4, 0, &random);
  const RowMatrixXf samples = SampleMixture(planted, 5000, &random);
  const GmmTraining training = Train(FixedIterations(1, 1), samples);

  ASSERT_EQ(training.mixture.NumComponents(), 1);
  EXPECT_EQ(training.mixture.weights[0], 1);
  for (Eigen::Index d = 0; d < 5; ++d) {
    const Eigen::VectorXd column = samples.col(d).cast<double>();
    const double mean = column.mean();
    EXPECT_NEAR(training.mixture.means(0, d), mean, 1e-6);
    EXPECT_NEAR(training.mixture.variances(0, d), (column.array() - mean).square().mean(), 1e-5);
  }
}

// With as many components as samples the start is known up to its order.
TEST(TrainGmmTest, StartsFromDifferentSamplesWithTheOverallVarianceAndEqualWeights) {
  Random random({14});
  const RowMatrixXf samples = SampleMixture(RandomMixture(4, 3, 6, 0, &random), 40, &random);
  GaussianMixture start;
  start.weights = Eigen::VectorXd::Constant(40, 1.0 / 40);
  start.means = samples.cast<double>();
  const RowMatrixXd centered = start.means.rowwise() - start.means.colwise().mean();
  start.variances = centered.cwiseAbs2().colwise().mean().replicate(40, 1);

  const GmmTraining training = Train(FixedIterations(40, 1), samples);
  ASSERT_EQ(training.mixture.NumComponents(), 40);
  ASSERT_THAT(training.log_likelihoods, SizeIs(1));
  EXPECT_NEAR(training.log_likelihoods[0], ReferenceMeanLogLikelihood(start, samples), 1e-5);

  const GaussianMixture expected = ReferenceEmStep(start, samples, 1e-4);
  for (Eigen::Index i = 0; i < 40; ++i) {
    double smallest = INFINITY;
    for (Eigen::Index k = 0; k < 40; ++k) {
      smallest = std::min(
          smallest, (training.mixture.means.row(k) - expected.means.row(i)).norm() +
                        (training.mixture.variances.row(k) - expected.variances.row(i)).norm());
    }
    EXPECT_LT(smallest, 1e-4) << i;
  }
}

struct TrainingCase {
  std::string name;
  RowMatrixXf samples;
  int num_components;
};

std::vector<TrainingCase> TrainingCases() {
  Random random({15});
  return {
      {"Overlapping", SampleMixture(RandomMixture(4, 5, 4, 0, &random), 3000, &random), 3},
      {"FarFromZero", SampleMixture(RandomMixture(4, 5, 4, 1000, &random), 3000, &random), 5},
      {"Padded", SampleMixture(RandomMixture(20, 16, 8, -3, &random), 5000, &random), 16},
      {"Sift", SampleSiftLike(1200, &random), 20},
  };
}

// The start is random, so the first update of both is taken from the training itself.
TEST(TrainGmmTest, EveryUpdateIsThatOfTheReference) {
  for (const TrainingCase& test : TrainingCases()) {
    SCOPED_TRACE(test.name);
    const GmmTraining first = Train(FixedIterations(test.num_components, 1), test.samples);
    const GmmTraining second = Train(FixedIterations(test.num_components, 2), test.samples);
    ASSERT_EQ(second.num_replaced_components, 0);
    const GaussianMixture expected = ReferenceEmStep(first.mixture, test.samples, 1e-4);
    const double scale = std::sqrt(expected.variances.mean());
    EXPECT_LT((second.mixture.weights - expected.weights).cwiseAbs().maxCoeff(), 1e-4);
    EXPECT_LT((second.mixture.means - expected.means).cwiseAbs().maxCoeff(), 1e-3 * scale);
    EXPECT_LT((second.mixture.variances - expected.variances).cwiseAbs().maxCoeff(),
              1e-3 * scale * scale);
  }
}

TEST(TrainGmmTest, ReachesTheLikelihoodOfTheReference) {
  constexpr int kNumIterations = 12;
  for (const TrainingCase& test : TrainingCases()) {
    SCOPED_TRACE(test.name);
    GaussianMixture mixture = Train(FixedIterations(test.num_components, 1), test.samples).mixture;
    const GmmTraining training =
        Train(FixedIterations(test.num_components, kNumIterations), test.samples);
    ASSERT_THAT(training.log_likelihoods, SizeIs(kNumIterations));
    ASSERT_EQ(training.num_replaced_components, 0);
    for (int i = 1; i < kNumIterations; ++i) {
      const double expected = ReferenceMeanLogLikelihood(mixture, test.samples);
      EXPECT_NEAR(training.log_likelihoods[static_cast<std::size_t>(i)], expected,
                  1e-4 * std::abs(expected))
          << "before update " << i;
      mixture = ReferenceEmStep(mixture, test.samples, 1e-4);
    }
    const double expected = ReferenceMeanLogLikelihood(mixture, test.samples);
    EXPECT_NEAR(ReferenceMeanLogLikelihood(training.mixture, test.samples), expected,
                1e-4 * std::abs(expected));
  }
}

TEST(TrainGmmTest, TheLikelihoodNeverFalls) {
  for (const TrainingCase& test : TrainingCases()) {
    SCOPED_TRACE(test.name);
    const GmmTraining training = Train(FixedIterations(test.num_components, 60), test.samples);
    ASSERT_EQ(training.num_replaced_components, 0);
    const std::vector<double>& values = training.log_likelihoods;
    ASSERT_GT(values.size(), 10u);
    for (std::size_t i = 1; i < values.size(); ++i) {
      // Sums over samples of single-precision numbers.
      EXPECT_GE(values[i], values[i - 1] - 2e-6 * std::abs(values[i])) << i;
    }
    EXPECT_GT(values.back(), values.front());
  }
}

TEST(TrainGmmTest, StopsWhenTheLikelihoodGrowsByLessThanTheTolerance) {
  for (const TrainingCase& test : TrainingCases()) {
    SCOPED_TRACE(test.name);
    GmmOptions options;
    options.num_components = test.num_components;
    options.tolerance = 1e-4;
    options.max_num_iterations = 1000;
    const GmmTraining training = Train(options, test.samples);
    EXPECT_TRUE(training.converged);
    const std::vector<double>& values = training.log_likelihoods;
    ASSERT_GE(values.size(), 3u);
    ASSERT_LT(values.size(), 1000u);
    for (std::size_t i = 1; i < values.size(); ++i) {
      const bool small = values[i] - values[i - 1] <= 1e-4 * std::abs(values[i]);
      EXPECT_EQ(small, i + 1 == values.size()) << i;
    }
  }
}

TEST(TrainGmmTest, StopsAfterTheLargestNumberOfIterations) {
  const TrainingCase test = TrainingCases().front();
  const GmmTraining training = Train(FixedIterations(test.num_components, 4), test.samples);
  EXPECT_THAT(training.log_likelihoods, SizeIs(4));
  EXPECT_FALSE(training.converged);
}

TEST(TrainGmmTest, RecoversPlantedComponents) {
  constexpr Eigen::Index kNumComponents = 8;
  constexpr Eigen::Index kDim = 6;
  constexpr Eigen::Index kNumSamples = 16000;
  Random random({16});
  const GaussianMixture planted = RandomMixture(kNumComponents, kDim, 200, 0, &random);
  const RowMatrixXf samples = SampleMixture(planted, kNumSamples, &random);
  for (const std::uint64_t seed : {0u, 1u, 2u}) {
    SCOPED_TRACE(seed);
    GmmOptions options;
    options.num_components = kNumComponents;
    const GmmTraining training = Train(options, samples, 2, seed);
    const GaussianMixture& mixture = training.mixture;
    ExpectValid(mixture, options.variance_floor);
    ASSERT_EQ(mixture.NumComponents(), kNumComponents);
    EXPECT_TRUE(training.converged);
    EXPECT_EQ(training.num_replaced_components, 0);
    std::vector<int> num_found(kNumComponents);
    for (Eigen::Index k = 0; k < kNumComponents; ++k) {
      Eigen::Index found = 0;
      (mixture.means.rowwise() - planted.means.row(k)).rowwise().squaredNorm().minCoeff(&found);
      ++num_found[static_cast<std::size_t>(found)];
      // Six standard errors.
      const double weight = planted.weights[k];
      const double num_samples = weight * static_cast<double>(kNumSamples);
      EXPECT_NEAR(mixture.weights[found], weight,
                  6 * std::sqrt(weight * (1 - weight) / static_cast<double>(kNumSamples)));
      for (Eigen::Index d = 0; d < kDim; ++d) {
        const double variance = planted.variances(k, d);
        EXPECT_NEAR(mixture.means(found, d), planted.means(k, d),
                    6 * std::sqrt(variance / num_samples));
        EXPECT_NEAR(mixture.variances(found, d), variance,
                    6 * variance * std::sqrt(2 / num_samples));
      }
    }
    EXPECT_THAT(num_found, Each(1));
  }
}

TEST(TrainGmmTest, IsBitwiseTheSameForAnyNumberOfThreads) {
  // Several chunks of 4096 samples, the last one not full. Sums of single-precision numbers in
  // double precision are mostly exact in any order; those of the likelihood are not, given enough
  // of them.
  Random random({17});
  const RowMatrixXf samples = SampleMixture(RandomMixture(9, 9, 3, 1, &random), 40000, &random);
  const GmmOptions options = FixedIterations(5, 25);
  const GmmTraining expected = Train(options, samples, 1);
  ASSERT_EQ(expected.mixture.NumComponents(), 5);
  ASSERT_THAT(expected.log_likelihoods, SizeIs(25));
  for (const int num_threads : {2, 3, 8, 16}) {
    SCOPED_TRACE(num_threads);
    ExpectExactlyEqual(Train(options, samples, num_threads), expected);
  }
}

TEST(TrainGmmTest, TheSeedDecides) {
  Random random({18});
  const RowMatrixXf samples = SampleMixture(RandomMixture(9, 6, 4, 0, &random), 3000, &random);
  GmmOptions options;
  options.num_components = 5;
  const GmmTraining training = Train(options, samples, 2, 1);
  ExpectExactlyEqual(Train(options, samples, 2, 1), training);

  const GmmTraining other = Train(options, samples, 2, 2);
  EXPECT_FALSE(ExactlyEqual(other.mixture.means, training.mixture.means));
  ExpectValid(other.mixture, options.variance_floor);
  EXPECT_EQ(other.mixture.NumComponents(), 5);
  EXPECT_NEAR(other.log_likelihoods.back(), training.log_likelihoods.back(), 1);
}

TEST(TrainGmmTest, SamplesFarFromZeroGiveTheSameMixtureElsewhere) {
  constexpr float kOffset = 1000;
  Random random({19});
  const RowMatrixXf far_samples =
      SampleMixture(RandomMixture(3, 7, 6, kOffset, &random), 4000, &random);
  const RowMatrixXf near_samples = far_samples.array() - kOffset;
  ASSERT_TRUE(ExactlyEqual(far_samples, RowMatrixXf(near_samples.array() + kOffset)));
  const GmmOptions options = FixedIterations(3, 15);
  const GaussianMixture far_mixture = Train(options, far_samples).mixture;
  const GaussianMixture near_mixture = Train(options, near_samples).mixture;
  EXPECT_LT((far_mixture.weights - near_mixture.weights).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT((far_mixture.means.array() - kOffset - near_mixture.means.array()).abs().maxCoeff(),
            1e-3);
  EXPECT_LT((far_mixture.variances - near_mixture.variances).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(TrainGmmTest, SiftDescriptorsGiveAUsableMixture) {
  Random random({20});
  const RowMatrixXf samples = SampleSiftLike(5000, &random);
  GmmOptions options;
  const GmmTraining training = Train(options, samples);
  ExpectValid(training.mixture, options.variance_floor);
  ASSERT_EQ(training.mixture.NumComponents(), options.num_components);
  EXPECT_TRUE(training.converged);
  EXPECT_GE(training.mixture.means.minCoeff(), -1e-6);
  EXPECT_LE(training.mixture.means.maxCoeff(), 0.5);
  const GaussianMixture single = Train(FixedIterations(1, 1), samples).mixture;
  EXPECT_GT(training.log_likelihoods.back(), ReferenceMeanLogLikelihood(single, samples) + 10);
}

TEST(TrainGmmTest, FewerSamplesThanComponentsGiveFewerComponents) {
  RowMatrixXf samples(3, 5);
  samples << 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0;
  const GmmOptions options;
  const GaussianMixture mixture = Train(options, samples).mixture;
  ExpectValid(mixture, options.variance_floor);
  EXPECT_EQ(mixture.NumComponents(), 3);
}

TEST(TrainGmmTest, OneSampleIsOneComponent) {
  RowMatrixXf samples(1, 5);
  samples << 0.5F, -1, 0, 3, 100;
  const GmmOptions options;
  const GmmTraining training = Train(options, samples);
  ExpectValid(training.mixture, options.variance_floor);
  ASSERT_EQ(training.mixture.NumComponents(), 1);
  EXPECT_TRUE(training.converged);
  EXPECT_EQ(training.mixture.weights[0], 1);
  EXPECT_LT((training.mixture.means - samples.cast<double>()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_TRUE((training.mixture.variances.array() == options.variance_floor).all());
}

TEST(TrainGmmTest, OneRepeatedSampleIsOneComponent) {
  // More than a block and than a chunk, with numbers that are no sums of a few powers of two.
  RowMatrixXf samples(5000, 3);
  samples.rowwise() = Eigen::RowVector3f(0.1F, 0.7F, -3.3F);
  const GmmOptions options;
  const GmmTraining training = Train(options, samples);
  ExpectValid(training.mixture, options.variance_floor);
  ASSERT_EQ(training.mixture.NumComponents(), 1);
  EXPECT_EQ(training.mixture.weights[0], 1);
  EXPECT_LT((training.mixture.means - samples.topRows(1).cast<double>()).cwiseAbs().maxCoeff(),
            1e-6);
  EXPECT_TRUE((training.mixture.variances.array() == options.variance_floor).all());
}

TEST(TrainGmmTest, TwoDifferentSamplesAreTwoComponents) {
  RowMatrixXf samples(40, 5);
  samples.topRows(10).rowwise() = Eigen::Matrix<float, 1, 5>(0.1F, 0.2F, 0.3F, 0.4F, 0.5F);
  samples.bottomRows(30).rowwise() = Eigen::Matrix<float, 1, 5>(0.9F, 0.1F, 0.7F, 0, 0.2F);
  const GmmOptions options;
  const GaussianMixture mixture = Train(options, samples).mixture;
  ExpectValid(mixture, options.variance_floor);
  ASSERT_EQ(mixture.NumComponents(), 2);
  const Eigen::Index first = mixture.weights[0] < mixture.weights[1] ? 0 : 1;
  EXPECT_NEAR(mixture.weights[first], 0.25, 1e-6);
  EXPECT_LT((mixture.means.row(first) - samples.row(0).cast<double>()).norm(), 1e-6);
  EXPECT_LT((mixture.means.row(1 - first) - samples.row(39).cast<double>()).norm(), 1e-6);
  EXPECT_TRUE((mixture.variances.array() == options.variance_floor).all());
}

TEST(TrainGmmTest, ConstantDimensionsStayAtTheSmallestVariance) {
  Random random({21});
  RowMatrixXf samples = SampleMixture(RandomMixture(3, 4, 6, 0, &random), 1000, &random);
  samples.col(2).setConstant(0.3F);
  GmmOptions options;
  options.num_components = 3;
  options.variance_floor = 0.01;
  const GaussianMixture mixture = Train(options, samples).mixture;
  ExpectValid(mixture, options.variance_floor);
  EXPECT_TRUE((mixture.variances.col(2).array() == options.variance_floor).all());
  EXPECT_LT((mixture.means.col(2).array() - 0.3).abs().maxCoeff(), 1e-6);
}

TEST(TrainGmmTest, StopsOnRequest) {
  const RowMatrixXf samples = RowMatrixXf::Identity(4, 4);
  ThreadPool threads(2);
  StopRequest stop;
  EXPECT_NO_THROW(TrainGmm(GmmOptions(), 0, samples, threads, &stop));
  stop.Raise();
  EXPECT_THROW(TrainGmm(GmmOptions(), 0, samples, threads, &stop), StoppedError);
}

// Three different samples, so that the start has one component at each. The smallest variance is so
// large that the two outer ones explain everything, and the middle one loses its samples.
class EmptyComponentTest : public ::testing::Test {
 protected:
  static constexpr double kVarianceFloor = 1;

  EmptyComponentTest() : samples_(401, 1) {
    samples_.topRows(200).setConstant(-3);
    samples_.middleRows(200, 200).setConstant(3);
    samples_(400, 0) = 0;
  }

  GmmTraining TrainIterations(int num_iterations) const {
    return Train(FixedIterations(3, num_iterations, kVarianceFloor), samples_);
  }

  RowMatrixXf samples_;
};

TEST_F(EmptyComponentTest, IsPlacedBesideTheWidestOne) {
  int num_iterations = 1;
  while (num_iterations < 60 && TrainIterations(num_iterations).num_replaced_components == 0) {
    ++num_iterations;
  }
  const GmmTraining after = TrainIterations(num_iterations);
  ASSERT_EQ(after.num_replaced_components, 1);
  ASSERT_GT(num_iterations, 1);
  const GmmTraining before = TrainIterations(num_iterations - 1);
  Eigen::Index empty = 0;
  before.mixture.weights.minCoeff(&empty);

  const GaussianMixture updated = ReferenceEmStep(before.mixture, samples_, kVarianceFloor);
  Eigen::Index widest = empty;
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (std::abs(after.mixture.means(k, 0) - updated.means(k, 0)) > 0.5 && k != empty) widest = k;
  }
  ASSERT_NE(widest, empty);
  const double step = std::sqrt(updated.variances(widest, 0));
  EXPECT_NEAR(after.mixture.means(empty, 0), updated.means(widest, 0) + step, 1e-4);
  EXPECT_NEAR(after.mixture.means(widest, 0), updated.means(widest, 0) - step, 1e-4);
  EXPECT_NEAR(after.mixture.variances(empty, 0), updated.variances(widest, 0), 1e-4);
  EXPECT_NEAR(after.mixture.weights[empty], updated.weights[widest] / 2, 1e-4);
  EXPECT_NEAR(after.mixture.weights[widest], updated.weights[widest] / 2, 1e-4);
}

TEST_F(EmptyComponentTest, NoComponentIsEmptyInTheEnd) {
  const GmmTraining training = TrainIterations(200);
  EXPECT_GE(training.num_replaced_components, 1);
  EXPECT_TRUE(training.converged);
  ExpectValid(training.mixture, kVarianceFloor);
  ASSERT_EQ(training.mixture.NumComponents(), 3);
  EXPECT_GT(training.mixture.weights.minCoeff(), 0.01);
  // Training goes on after the likelihood fell by the replacement.
  EXPECT_LT((training.mixture.means.array().abs() - 3).abs().maxCoeff(), 0.05);
}

TEST_F(EmptyComponentTest, TheLikelihoodFallsAtMostOnceForEveryReplacedComponent) {
  const GmmTraining training = TrainIterations(200);
  int num_falls = 0;
  for (std::size_t i = 1; i < training.log_likelihoods.size(); ++i) {
    if (training.log_likelihoods[i] < training.log_likelihoods[i - 1] - 1e-5) ++num_falls;
  }
  EXPECT_LE(num_falls, training.num_replaced_components);
}

TEST(GmmOptionsTest, DefaultsAreValid) {
  EXPECT_NO_THROW(GmmOptions().Check());
  EXPECT_EQ(GmmOptions().num_components, 64);
}

TEST(GmmOptionsTest, InvalidOptionsAreRefused) {
  const RowMatrixXf samples = RowMatrixXf::Identity(4, 4);
  const auto expect_refused = [&](const GmmOptions& options) {
    EXPECT_THROW(options.Check(), OptionsError);
    EXPECT_THROW(Train(options, samples), OptionsError);
  };
  for (const int value : {0, -1}) {
    GmmOptions options;
    options.num_components = value;
    expect_refused(options);
    options = GmmOptions();
    options.max_num_iterations = value;
    expect_refused(options);
  }
  for (const double value : {-1e-9, std::nan("")}) {
    GmmOptions options;
    options.tolerance = value;
    expect_refused(options);
    options = GmmOptions();
    options.variance_floor = value;
    expect_refused(options);
  }
  GmmOptions options;
  options.variance_floor = 0;
  expect_refused(options);
}

TEST(GmmOptionsTest, TheSeedAndEveryFieldChangeTheKey) {
  std::set<std::string> keys = {GmmOptions().Key(0), GmmOptions().Key(16)};
  EXPECT_EQ(keys.size(), 2U);
  const std::vector<void (*)(GmmOptions*)> changes = {
      [](GmmOptions* o) { o->num_components = 16; },
      [](GmmOptions* o) { o->tolerance = std::nextafter(o->tolerance, 1); },
      [](GmmOptions* o) { o->max_num_iterations = 16; },
      [](GmmOptions* o) { o->variance_floor = std::nextafter(o->variance_floor, 1); }};
  for (const auto& change : changes) {
    GmmOptions options;
    change(&options);
    EXPECT_TRUE(keys.insert(options.Key(0)).second) << options.Key(0);
    EXPECT_EQ(options.Key(0), GmmOptions(options).Key(0));
  }
}

// With other words the mixtures of earlier runs would no longer be found.
TEST(GmmOptionsTest, StateFilesHaveTheKeyInTheseWords) {
  EXPECT_EQ(GmmOptions().Key(7),
            "components 64, tolerance 0x1.4f8b588e368f1p-17, iterations 100, variance floor "
            "0x1.a36e2eb1c432dp-14, seed 7");
}

TEST(GmmOptionsTest, NoSamplesAreRefused) {
  EXPECT_THROW(Train(GmmOptions(), RowMatrixXf(0, 128)), OptionsError);
}

// Every instruction set of this processor that the code was compiled for.
class MatrixProductTest : public ::testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam()); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
};

std::string NameOfTarget(const ::testing::TestParamInfo<std::int64_t>& info) {
  return hwy::TargetName(info.param);
}

INSTANTIATE_TEST_SUITE_P(Targets, MatrixProductTest, ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         NameOfTarget);

std::vector<float> RandomNumbers(std::size_t count, Random* random) {
  std::vector<float> numbers(count);
  for (float& number : numbers) number = static_cast<float>(Normal(random));
  return numbers;
}

TEST_P(MatrixProductTest, IsThatOfTheReferenceForAllSizesAndStrides) {
  Random random({22});
  const std::size_t sizes[] = {1, 2, 5, 6, 7, 12, 13, 31};
  for (const std::size_t rows : sizes) {
    for (const std::size_t inner : {1u, 2u, 10u, 33u, 256u}) {
      for (const std::size_t cols : {16u, 32u, 48u, 80u, 272u}) {
        const std::vector<float> b = RandomNumbers(inner * cols, &random);
        // Row-major, row-major with gaps, transposed, and with gaps in both directions.
        const std::size_t strides[][2] = {
            {inner, 1}, {inner + 3, 1}, {1, rows}, {1, rows + 5}, {2 * inner + 1, 2}};
        for (const auto& stride : strides) {
          const std::size_t size_of_a = (rows - 1) * stride[0] + (inner - 1) * stride[1] + 1;
          const std::vector<float> a = RandomNumbers(size_of_a, &random);
          constexpr std::size_t kNumGuards = 32;
          std::vector<float> c(rows * cols + kNumGuards, 12345);
          MatrixProduct({a.data(), stride[0], stride[1]}, b.data(), rows, inner, cols, c.data());
          for (std::size_t i = 0; i < rows; ++i) {
            for (std::size_t j = 0; j < cols; ++j) {
              double expected = 0;
              double magnitude = 0;
              for (std::size_t k = 0; k < inner; ++k) {
                const double product = static_cast<double>(a[i * stride[0] + k * stride[1]]) *
                                       static_cast<double>(b[k * cols + j]);
                expected += product;
                magnitude += std::abs(product);
              }
              ASSERT_NEAR(static_cast<double>(c[i * cols + j]), expected, 2e-6 * magnitude)
                  << rows << " x " << inner << " x " << cols << " at " << i << ", " << j;
            }
          }
          ASSERT_THAT(std::vector<float>(c.end() - kNumGuards, c.end()), Each(12345));
        }
      }
    }
  }
}

TEST_P(MatrixProductTest, SumsInTheOrderOfTheInnerIndex) {
  constexpr std::size_t kRows = 13;
  constexpr std::size_t kInner = 300;
  constexpr std::size_t kCols = 48;
  Random random({23});
  const std::vector<float> a = RandomNumbers(kRows * kInner, &random);
  const std::vector<float> b = RandomNumbers(kInner * kCols, &random);
  std::vector<float> c(kRows * kCols);
  MatrixProduct({a.data(), kInner, 1}, b.data(), kRows, kInner, kCols, c.data());
  std::vector<float> fused(kRows * kCols);
  std::vector<float> unfused(kRows * kCols);
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t j = 0; j < kCols; ++j) {
      for (std::size_t k = 0; k < kInner; ++k) {
        const float x = a[i * kInner + k];
        const float y = b[k * kCols + j];
        fused[i * kCols + j] = std::fma(x, y, fused[i * kCols + j]);
        unfused[i * kCols + j] += x * y;
      }
    }
  }
  // Not every processor has a fused multiply-add.
  EXPECT_TRUE(c == fused || c == unfused);
}

TEST_P(MatrixProductTest, RunsOnTheTargetThatIsTested) {
  const std::vector<float> ones(16, 1);
  std::vector<float> product(16);
  MatrixProduct({ones.data(), 1, 1}, ones.data(), 1, 1, 16, product.data());
  EXPECT_THAT(product, Each(1));
  if (hwy::SupportedTargets() == GetParam() && hwy::GetChosenTarget().IsInitialized()) {
    hwy::ChosenTarget expected;
    expected.Update(GetParam());
    EXPECT_EQ(hwy::GetChosenTarget().GetIndex(), expected.GetIndex());
  }
}

}  // namespace
}  // namespace colmap_graphmatch
