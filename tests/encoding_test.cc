#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/encoding/fisher_vector.h"
#include "colmap_graphmatch/encoding/gist.h"
#include "colmap_graphmatch/encoding/pca.h"
#include "colmap_graphmatch/encoding/vlad.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Uniform in [0, 1) times (j + 1) in column j.
RowMatrixXf MakeSamples(Eigen::Index rows, Eigen::Index cols, std::uint64_t seed) {
  Random random({seed});
  RowMatrixXf samples(rows, cols);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < cols; ++j) {
      samples(i, j) = static_cast<float>(j + 1) * static_cast<float>(random.Index(1000)) / 1000;
    }
  }
  return samples;
}

GaussianMixture MakeMixture(Eigen::Index num_components, Eigen::Index dim) {
  GaussianMixture mixture;
  mixture.weights = Eigen::VectorXd::Constant(num_components, 1.0 / double(num_components));
  mixture.means = MakeSamples(num_components, dim, 5).cast<double>();
  mixture.variances = RowMatrixXd::Constant(num_components, dim, 0.1);
  return mixture;
}

TEST(Vlad, IsTheSumOfResidualsToTheNearestCentre) {
  constexpr Eigen::Index kDim = 7;
  const GaussianMixture mixture = MakeMixture(5, kDim);
  const RowMatrixXf samples = MakeSamples(200, kDim, 1);
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(5 * kDim);
  for (Eigen::Index i = 0; i < samples.rows(); ++i) {
    Eigen::Index nearest = 0;
    for (Eigen::Index k = 1; k < 5; ++k) {
      const auto distance = [&](Eigen::Index centre) {
        return (samples.row(i).cast<double>() - mixture.means.row(centre)).squaredNorm();
      };
      if (distance(k) < distance(nearest)) nearest = k;
    }
    expected.segment(nearest * kDim, kDim) +=
        (samples.row(i).cast<double>() - mixture.means.row(nearest)).transpose();
  }
  for (double& entry : expected) entry = std::copysign(std::sqrt(std::abs(entry)), entry);
  expected.normalize();
  const VladEncoder encoder(mixture);
  EXPECT_EQ(encoder.Dim(), 5 * kDim);
  const Eigen::VectorXf vector = encoder.Encode(samples);
  EXPECT_LT((vector.cast<double>() - expected).norm(), 1e-4);
}

TEST(Vlad, IsZeroForTheCentresThemselves) {
  GaussianMixture mixture = MakeMixture(3, 4);
  mixture.means = mixture.means.cast<float>().cast<double>();
  EXPECT_EQ(VladEncoder(mixture).Encode(mixture.means.cast<float>()).norm(), 0);
}

TEST(Pca, FindsTheAxesByDescendingVariance) {
  ThreadPool threads(1);
  const Pca pca = LearnPca(MakeSamples(20000, 4, 2), 3, threads);
  // Column j has a standard deviation in proportion to j + 1.
  for (Eigen::Index i = 0; i < 3; ++i) EXPECT_GT(pca.basis(i, 3 - i), 0.99);
  for (Eigen::Index j = 0; j < 4; ++j) EXPECT_NEAR(pca.mean[j], 0.5 * double(j + 1), 0.03);
  EXPECT_LT((pca.basis * pca.basis.transpose() - RowMatrixXd::Identity(3, 3)).norm(), 1e-9);
}

TEST(Pca, AllComponentsKeepDistances) {
  ThreadPool threads(1);
  const RowMatrixXf samples = MakeSamples(300, 6, 3);
  const RowMatrixXf projected = LearnPca(samples, 6, threads).Project(samples);
  for (Eigen::Index i = 1; i < samples.rows(); ++i) {
    EXPECT_NEAR((projected.row(i) - projected.row(0)).norm(),
                (samples.row(i) - samples.row(0)).norm(), 1e-3);
  }
  EXPECT_LT(projected.colwise().mean().norm(), 1e-3);
}

TEST(Pca, IsTheSameOnAnyNumberOfThreads) {
  const RowMatrixXf samples = MakeSamples(10000, 16, 4);
  ThreadPool one(1);
  ThreadPool three(3);
  const Pca expected = LearnPca(samples, 8, one);
  const Pca pca = LearnPca(samples, 8, three);
  EXPECT_EQ(pca.mean, expected.mean);
  EXPECT_EQ(pca.basis, expected.basis);
}

TEST(Pca, DimensionsThatThereAreNot) {
  ThreadPool threads(1);
  EXPECT_THROW(LearnPca(MakeSamples(10, 4, 1), 0, threads), OptionsError);
  EXPECT_THROW(LearnPca(MakeSamples(10, 4, 1), 5, threads), OptionsError);
}

TEST(FisherVector, TakesDescriptorsOfAnyDimension) {
  ThreadPool threads(1);
  for (const Eigen::Index dim : {1, 5, 64}) {
    GmmOptions options;
    options.num_components = 3;
    const RowMatrixXf samples = MakeSamples(500, dim, 6);
    const FisherVectorEncoder encoder(TrainGmm(options, 0, samples, threads).mixture);
    EXPECT_EQ(encoder.Dim(), 2 * 3 * dim);
    EXPECT_NEAR(encoder.Encode(samples.topRows(50)).norm(), 1, 1e-5);
  }
}

class GistTest : public ::testing::Test {
 protected:
  Eigen::VectorXf Encode(const cv::Mat& image) {
    cv::imwrite(path_.string(), image);
    return EncodeGistFile(path_.parent_path(), path_.filename().string());
  }

  // Stripes of `wavelength` pixels; angle 0: vertical ones. Within `where`, grey elsewhere.
  static cv::Mat Stripes(double wavelength, double angle, const cv::Rect& where) {
    cv::Mat image(256, 256, CV_8U, cv::Scalar(128));
    for (int y = where.y; y < where.y + where.height; ++y) {
      for (int x = where.x; x < where.x + where.width; ++x) {
        const double phase = (x * std::cos(angle) + y * std::sin(angle)) * 2 * M_PI / wavelength;
        image.at<unsigned char>(y, x) = static_cast<unsigned char>(128 + 80 * std::sin(phase));
      }
    }
    return image;
  }

  // Sums over the cells: by filter.
  static Eigen::VectorXf ByFilter(const Eigen::VectorXf& gist) {
    return Eigen::Map<const RowMatrixXf>(gist.data(), 32, 16).rowwise().sum();
  }
  static Eigen::VectorXf ByCell(const Eigen::VectorXf& gist) {
    return Eigen::Map<const RowMatrixXf>(gist.data(), 32, 16).colwise().sum().transpose();
  }

  TestDirectory directory_;
  std::filesystem::path path_ = directory_.Path() / "photo.png";
};

const cv::Rect kWhole(0, 0, 256, 256);

TEST_F(GistTest, AStripedImageExcitesItsOrientationAndScale) {
  Eigen::Index vertical = 0;
  ByFilter(Encode(Stripes(4, 0, kWhole))).maxCoeff(&vertical);
  Eigen::Index horizontal = 0;
  ByFilter(Encode(Stripes(4, M_PI / 2, kWhole))).maxCoeff(&horizontal);
  Eigen::Index coarse = 0;
  ByFilter(Encode(Stripes(12, 0, kWhole))).maxCoeff(&coarse);
  EXPECT_EQ(vertical, 0);
  EXPECT_EQ(horizontal, 4);
  EXPECT_EQ(coarse % 8, 0);
  EXPECT_GT(coarse, 7);
}

TEST_F(GistTest, CellsSayWhere) {
  Eigen::Index cell = 0;
  ByCell(Encode(Stripes(4, 0, cv::Rect(192, 64, 64, 64)))).maxCoeff(&cell);
  EXPECT_EQ(cell, 1 * 4 + 3);
}

TEST_F(GistTest, HasUnitLengthAndDoesNotMindBrightness) {
  const cv::Mat image = Stripes(8, 0.7, cv::Rect(30, 40, 150, 120));
  const Eigen::VectorXf gist = Encode(image);
  ASSERT_EQ(static_cast<std::size_t>(gist.size()), kGistDim);
  EXPECT_NEAR(gist.norm(), 1, 1e-5);
  EXPECT_LT((Encode(image * 0.7) - gist).norm(), 0.1);
  EXPECT_GT((Encode(Stripes(8, 0.7 + M_PI / 2, cv::Rect(30, 40, 150, 120))) - gist).norm(), 0.3);
}

TEST_F(GistTest, AnImageOfOneColourHasNone) {
  EXPECT_EQ(Encode(cv::Mat(300, 200, CV_8UC3, cv::Scalar(90, 60, 200))).norm(), 0);
}

TEST_F(GistTest, WhatIsNoImage) {
  EXPECT_THAT([&] { EncodeGistFile(directory_.Path(), "none.jpg"); },
              ThrowsMessage<FileError>(HasSubstr("No such file or directory")));
  std::ofstream(path_) << "no image";
  EXPECT_THAT([&] { EncodeGistFile(path_.parent_path(), path_.filename().string()); },
              ThrowsMessage<FileError>(HasSubstr("damaged")));
}

}  // namespace
}  // namespace colmap_graphmatch
