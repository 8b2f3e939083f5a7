#include "colmap_graphmatch/encoding/fisher_vector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/encoding/descriptor_selection.h"
#include "colmap_graphmatch/encoding/gmm.h"
#include "colmap_graphmatch/encoding/matrix.h"
#include "tests/support/reference_encoding.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Components so far apart that every sample belongs to one alone.
GaussianMixture SeparateMixture(Eigen::Index num_components, Eigen::Index dim) {
  Random random({31});
  GaussianMixture mixture = RandomMixture(num_components, dim, 1, 0, &random);
  for (Eigen::Index k = 0; k < num_components; ++k) {
    mixture.means(k, 0) += 30 * static_cast<double>(k);
  }
  return mixture;
}

GaussianMixture SiftMixture(const RowMatrixXf& samples) {
  ThreadPool threads(2);
  GmmOptions options;
  options.max_num_iterations = 10;
  return TrainGmm(options, 0, samples, threads).mixture;
}

void ExpectGradientOfTheReference(const GaussianMixture& mixture, const RowMatrixXf& descriptors) {
  const FisherVectorEncoder encoder(mixture);
  const Eigen::VectorXd gradient = encoder.Gradient(descriptors);
  const Eigen::VectorXd expected = ReferenceGradient(mixture, descriptors);
  ASSERT_EQ(gradient.size(), 2 * mixture.NumComponents() * mixture.Dim());
  ASSERT_EQ(gradient.size(), encoder.Dim());
  // Relative to one standard deviation of a single descriptor, which the sums are made of: the
  // gradient of samples like those of the training nearly cancels.
  const double scale = std::max(1.0, expected.cwiseAbs().maxCoeff());
  EXPECT_LT((gradient - expected).cwiseAbs().maxCoeff(), 1e-4 * scale);

  const Eigen::VectorXf vector = encoder.Encode(descriptors);
  const Eigen::VectorXd expected_vector = ReferenceFisherVector(mixture, descriptors);
  ASSERT_EQ(vector.size(), encoder.Dim());
  // An error of e in the gradient is one of up to sqrt(e) after the square root.
  EXPECT_LT((vector.cast<double>() - expected_vector).norm(), 1e-2);
  EXPECT_NEAR(vector.cast<double>().norm(), 1, 1e-6);
}

TEST(FisherVectorTest, IsThatOfTheReference) {
  for (const Eigen::Index num_components : {1, 3, 16, 20}) {
    for (const Eigen::Index dim : {1, 5, 16, 40}) {
      for (const Eigen::Index num_descriptors : {1, 2, 255, 256, 257, 900}) {
        SCOPED_TRACE(::testing::Message()
                     << "K=" << num_components << " D=" << dim << " N=" << num_descriptors);
        Random random({32, static_cast<std::uint64_t>(num_components + 100 * dim)});
        const GaussianMixture mixture = RandomMixture(num_components, dim, 3, 0, &random);
        const GaussianMixture other = RandomMixture(4, dim, 4, 0, &random);
        ExpectGradientOfTheReference(mixture, SampleMixture(other, num_descriptors, &random));
      }
    }
  }
}

TEST(FisherVectorTest, IsThatOfTheReferenceForSiftDescriptors) {
  Random random({33});
  const RowMatrixXf samples = SampleSiftLike(2000, &random);
  const GaussianMixture mixture = SiftMixture(samples);
  ASSERT_EQ(mixture.NumComponents(), 64);
  ExpectGradientOfTheReference(mixture, samples.topRows(700));
  ExpectGradientOfTheReference(mixture, SampleSiftLike(700, &random));
  ExpectGradientOfTheReference(mixture, samples.topRows(1));
}

TEST(FisherVectorTest, IsThatOfTheReferenceFarFromZero) {
  Random random({34});
  const GaussianMixture mixture = RandomMixture(5, 7, 4, 1000, &random);
  const GaussianMixture other = RandomMixture(5, 7, 4, 1000, &random);
  ExpectGradientOfTheReference(mixture, SampleMixture(other, 500, &random));
}

TEST(FisherVectorTest, AllMeansComeBeforeAllVariances) {
  constexpr Eigen::Index kNumComponents = 3;
  constexpr Eigen::Index kDim = 4;
  GaussianMixture mixture;
  mixture.weights = Eigen::Vector3d(0.2, 0.3, 0.5);
  mixture.means = RowMatrixXd::Zero(kNumComponents, kDim);
  mixture.means.col(0) = Eigen::Vector3d(-16, 0, 16);
  mixture.variances = RowMatrixXd::Constant(kNumComponents, kDim, 0.25);
  mixture.variances(1, 2) = 4;

  // At the component 1, but two standard deviations off in the dimension 2.
  RowMatrixXf descriptors = RowMatrixXf::Zero(5, kDim);
  descriptors.col(2).setConstant(4);
  const Eigen::VectorXd gradient = FisherVectorEncoder(mixture).Gradient(descriptors);
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(2 * kNumComponents * kDim);
  expected[1 * kDim + 2] = 2 / std::sqrt(0.3);
  for (Eigen::Index d = 0; d < kDim; ++d) {
    expected[kNumComponents * kDim + 1 * kDim + d] = (d == 2 ? 4 - 1 : -1) / std::sqrt(2 * 0.3);
  }
  EXPECT_LT((gradient - expected).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(FisherVectorTest, MovingTheSamplesOfOneComponentMovesItsEntriesOnly) {
  constexpr Eigen::Index kNumComponents = 4;
  constexpr Eigen::Index kDim = 5;
  constexpr Eigen::Index kMoved = 2;
  const GaussianMixture mixture = SeparateMixture(kNumComponents, kDim);
  Random random({35});
  const RowMatrixXf descriptors = SampleMixture(mixture, 2000, &random);
  GaussianMixture moved = mixture;
  moved.means.row(kMoved).array() += 0.5;
  Random same_random({35});
  const RowMatrixXf moved_descriptors = SampleMixture(moved, 2000, &same_random);

  const FisherVectorEncoder encoder(mixture);
  const Eigen::VectorXd difference =
      encoder.Gradient(moved_descriptors) - encoder.Gradient(descriptors);
  for (Eigen::Index k = 0; k < kNumComponents; ++k) {
    for (Eigen::Index d = 0; d < kDim; ++d) {
      const double u = difference[k * kDim + d];
      const double v = difference[(kNumComponents + k) * kDim + d];
      if (k == kMoved) {
        EXPECT_GT(u, 0.05) << d;
        EXPECT_GT(v, 1e-3) << d;
      } else {
        EXPECT_NEAR(u, 0, 1e-4) << k << " " << d;
        EXPECT_NEAR(v, 0, 1e-4) << k << " " << d;
      }
    }
  }
}

TEST(FisherVectorTest, IsTheGradientWithSignedSquareRootsAtUnitLength) {
  Random random({36});
  const GaussianMixture mixture = RandomMixture(3, 4, 2, 0, &random);
  const RowMatrixXf descriptors = SampleMixture(RandomMixture(3, 4, 3, 0, &random), 50, &random);
  const FisherVectorEncoder encoder(mixture);
  const Eigen::VectorXd gradient = encoder.Gradient(descriptors);
  const Eigen::VectorXf vector = encoder.Encode(descriptors);
  ASSERT_LT(gradient.minCoeff(), 0);
  ASSERT_GT(gradient.maxCoeff(), 0);
  // The sum of |z| is the squared length after the square root.
  const double norm = std::sqrt(gradient.lpNorm<1>());
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    const double expected = (gradient[i] < 0 ? -1 : 1) * std::sqrt(std::abs(gradient[i])) / norm;
    EXPECT_NEAR(static_cast<double>(vector[i]), expected, 1e-6);
  }
}

TEST(FisherVectorTest, HasUnitLength) {
  Random random({37});
  const RowMatrixXf samples = SampleSiftLike(3000, &random);
  const FisherVectorEncoder encoder(SiftMixture(samples));
  for (const Eigen::Index num_descriptors : {1, 2, 10, 300, 3000}) {
    const Eigen::VectorXf vector = encoder.Encode(samples.topRows(num_descriptors));
    EXPECT_NEAR(vector.cast<double>().norm(), 1, 1e-6) << num_descriptors;
  }
}

// With components that do not overlap, every entry has the variance 1 / N.
TEST(FisherVectorTest, TendsToZeroForSamplesOfTheMixtureItself) {
  constexpr Eigen::Index kNumComponents = 8;
  constexpr Eigen::Index kDim = 16;
  const GaussianMixture mixture = SeparateMixture(kNumComponents, kDim);
  const FisherVectorEncoder encoder(mixture);
  Random random({38});
  for (const Eigen::Index num_descriptors : {300, 3000, 30000}) {
    const RowMatrixXf descriptors = SampleMixture(mixture, num_descriptors, &random);
    const Eigen::VectorXd gradient = encoder.Gradient(descriptors);
    const double num_entries = kNumComponents * kDim;
    const auto num = static_cast<double>(num_descriptors);
    // 128 entries each: the mean of their squares is within about 1 +- 0.12.
    EXPECT_NEAR(gradient.head(kNumComponents * kDim).squaredNorm() * num / num_entries, 1, 0.5)
        << num_descriptors;
    EXPECT_NEAR(gradient.tail(kNumComponents * kDim).squaredNorm() * num / num_entries, 1, 0.5)
        << num_descriptors;
  }
}

TEST(FisherVectorTest, DoesNotTendToZeroForSamplesOfAnotherMixture) {
  const GaussianMixture mixture = SeparateMixture(8, 16);
  GaussianMixture other = mixture;
  other.means.array() += 0.3;
  Random random({39});
  const RowMatrixXf descriptors = SampleMixture(other, 10000, &random);
  EXPECT_GT(FisherVectorEncoder(mixture).Gradient(descriptors).norm(), 1);
}

TEST(FisherVectorTest, GradientIsTheMeanOfThoseOfTheDescriptors) {
  Random random({40});
  const GaussianMixture mixture = RandomMixture(5, 6, 3, 0, &random);
  const RowMatrixXf descriptors = SampleMixture(RandomMixture(5, 6, 4, 0, &random), 300, &random);
  const FisherVectorEncoder encoder(mixture);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(encoder.Dim());
  for (Eigen::Index i = 0; i < descriptors.rows(); ++i) {
    mean += encoder.Gradient(descriptors.row(i)) / static_cast<double>(descriptors.rows());
  }
  EXPECT_LT((encoder.Gradient(descriptors) - mean).norm(), 1e-5 * mean.norm());
}

TEST(FisherVectorTest, RepeatedDescriptorsAreEncodedAsOne) {
  Random random({41});
  const GaussianMixture mixture = RandomMixture(5, 6, 3, 0, &random);
  const RowMatrixXf descriptor = SampleMixture(mixture, 1, &random);
  const FisherVectorEncoder encoder(mixture);
  const Eigen::VectorXd gradient = encoder.Gradient(descriptor);
  for (const Eigen::Index num_copies : {2, 7, 600}) {
    const RowMatrixXf copies = descriptor.replicate(num_copies, 1);
    EXPECT_LT((encoder.Gradient(copies) - gradient).norm(), 1e-4 * gradient.norm());
    EXPECT_GT(encoder.Encode(copies).dot(encoder.Encode(descriptor)), 1 - 1e-4F);
  }
}

TEST(FisherVectorTest, IsZeroIfTheGradientIs) {
  GaussianMixture mixture;
  mixture.weights = Eigen::VectorXd::Ones(1);
  mixture.means = RowMatrixXd::Zero(1, 1);
  mixture.variances = RowMatrixXd::Ones(1, 1);
  // Mean and variance are exactly those of the mixture.
  const RowMatrixXf descriptors = Eigen::Vector2f(-1, 1);
  const FisherVectorEncoder encoder(mixture);
  EXPECT_TRUE(encoder.Gradient(descriptors).isZero(0));
  const Eigen::VectorXf vector = encoder.Encode(descriptors);
  ASSERT_EQ(vector.size(), 2);
  EXPECT_EQ(vector[0], 0);
  EXPECT_EQ(vector[1], 0);
}

TEST(FisherVectorTest, IsFiniteForUnusualDescriptors) {
  Random random({42});
  const RowMatrixXf samples = SampleSiftLike(1000, &random);
  GaussianMixture mixture = SiftMixture(samples);
  // The lightest and narrowest component that training may leave.
  mixture.weights[3] = 1e-9;
  mixture.weights /= mixture.weights.sum();
  mixture.variances.row(5).setConstant(1e-4);
  const FisherVectorEncoder encoder(mixture);
  std::vector<RowMatrixXf> images = {RowMatrixXf::Zero(1, 128),
                                     RowMatrixXf::Zero(300, 128),
                                     RowMatrixXf::Constant(1, 128, 255.0F / 512),
                                     RowMatrixXf::Constant(3, 128, 1000),
                                     mixture.means.row(3).cast<float>(),
                                     mixture.means.cast<float>()};
  RowMatrixXf single = RowMatrixXf::Zero(1, 128);
  single(0, 77) = 255.0F / 512;
  images.push_back(single);
  for (std::size_t i = 0; i < images.size(); ++i) {
    EXPECT_TRUE(encoder.Gradient(images[i]).allFinite()) << i;
    const Eigen::VectorXf vector = encoder.Encode(images[i]);
    EXPECT_TRUE(vector.allFinite()) << i;
    EXPECT_NEAR(vector.cast<double>().norm(), 1, 1e-5) << i;
  }
}

TEST(FisherVectorTest, ImagesOfTheSamePlaceAreNearerThanImagesOfDifferentOnes) {
  constexpr int kNumPlaces = 5;
  constexpr int kImagesPerPlace = 3;
  Random random({43});
  const GaussianMixture mixture = RandomMixture(6, 8, 6, 0, &random);
  const FisherVectorEncoder encoder(mixture);
  std::vector<Eigen::VectorXf> vectors;
  for (int place = 0; place < kNumPlaces; ++place) {
    GaussianMixture shifted = mixture;
    for (Eigen::Index i = 0; i < shifted.means.size(); ++i) {
      shifted.means.data()[i] += 0.7 * Normal(&random);
    }
    for (int image = 0; image < kImagesPerPlace; ++image) {
      vectors.push_back(encoder.Encode(SampleMixture(shifted, 500, &random)));
    }
  }
  float nearest_other_place = 4;
  float farthest_same_place = 0;
  for (std::size_t a = 0; a < vectors.size(); ++a) {
    for (std::size_t b = a + 1; b < vectors.size(); ++b) {
      const float distance = (vectors[a] - vectors[b]).squaredNorm();
      if (a / kImagesPerPlace == b / kImagesPerPlace) {
        farthest_same_place = std::max(farthest_same_place, distance);
      } else {
        nearest_other_place = std::min(nearest_other_place, distance);
      }
    }
  }
  EXPECT_LT(farthest_same_place, nearest_other_place);
}

TEST(SelectRandomTest, ReturnsDifferentRowsAscending) {
  for (const std::size_t max_num : {0u, 1u, 2u, 50u, 99u}) {
    const std::vector<std::size_t> rows = SelectRandom(100, max_num, Random({45}));
    ASSERT_THAT(rows, SizeIs(max_num));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_LT(rows[i], 100u);
      EXPECT_TRUE(i == 0 || rows[i - 1] < rows[i]) << i;
    }
  }
}

TEST(SelectRandomTest, ReturnsAllRowsIfThereAreNoMore) {
  EXPECT_THAT(SelectRandom(3, 3, Random({46})), ElementsAre(0, 1, 2));
  EXPECT_THAT(SelectRandom(3, 100, Random({46})), ElementsAre(0, 1, 2));
  EXPECT_THAT(SelectRandom(0, 3, Random({46})), IsEmpty());
}

TEST(SelectRandomTest, IsDecidedByTheGenerator) {
  EXPECT_EQ(SelectRandom(1000, 50, Random({47})), SelectRandom(1000, 50, Random({47})));
  EXPECT_NE(SelectRandom(1000, 50, Random({47})), SelectRandom(1000, 50, Random({48})));
}

TEST(SelectRandomTest, SelectsEveryRowAndEveryPairOfRowsEquallyOften) {
  constexpr std::size_t kNumRows = 10;
  constexpr std::size_t kMaxNum = 3;
  constexpr std::uint64_t kNumDraws = 30000;
  std::vector<int> counts(kNumRows);
  std::vector<int> pair_counts(kNumRows * kNumRows);
  for (std::uint64_t draw = 0; draw < kNumDraws; ++draw) {
    const std::vector<std::size_t> rows = SelectRandom(kNumRows, kMaxNum, Random({49, draw}));
    for (const std::size_t a : rows) {
      ++counts[a];
      for (const std::size_t b : rows) ++pair_counts[a * kNumRows + b];
    }
  }
  // 9000 and 2000 are expected, with standard deviations of 79 and 43.
  for (std::size_t a = 0; a < kNumRows; ++a) {
    EXPECT_NEAR(counts[a], 9000, 480) << a;
    for (std::size_t b = 0; b < a; ++b) {
      EXPECT_NEAR(pair_counts[a * kNumRows + b], 2000, 260) << a << " " << b;
    }
  }
}

TEST(DescriptorsToFloatTest, DividesTheRowsBy512) {
  constexpr std::size_t kNumRows = 6;
  constexpr std::size_t kDim = 128;
  std::vector<std::uint8_t> descriptors(kNumRows * kDim);
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    descriptors[i] = static_cast<std::uint8_t>(i * 37 + i / kDim);
  }
  for (const std::size_t num : {std::size_t{1}, kNumRows}) {
    const RowMatrixXf matrix = DescriptorsToFloat(descriptors.data(), num);
    ASSERT_EQ(matrix.rows(), static_cast<Eigen::Index>(num));
    ASSERT_EQ(matrix.cols(), 128);
    for (std::size_t i = 0; i < num; ++i) {
      for (std::size_t d = 0; d < kDim; ++d) {
        const int byte = descriptors[i * kDim + d];
        ASSERT_EQ(matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(d)),
                  static_cast<float>(byte) / 512)
            << i << " " << d;
      }
    }
  }
}

TEST(DescriptorsToFloatTest, CoversAllBytesAndNoRows) {
  std::vector<std::uint8_t> descriptors(256);
  std::iota(descriptors.begin(), descriptors.end(), std::uint8_t{0});
  const RowMatrixXf matrix = DescriptorsToFloat(descriptors.data(), 2);
  EXPECT_EQ(matrix(0, 0), 0);
  EXPECT_EQ(matrix(1, 0), 0.25F);
  EXPECT_EQ(matrix(1, 127), 255.0F / 512);
  EXPECT_EQ(DescriptorsToFloat(descriptors.data(), 0).rows(), 0);
}

}  // namespace
}  // namespace colmap_graphmatch
