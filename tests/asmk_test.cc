#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/encoding/kmeans.h"
#include "colmap_graphmatch/encoding/visual_word_encoder.h"
#include "colmap_graphmatch/encoding/vocabulary.h"
#include "colmap_graphmatch/ranking/asmk_ranking.h"
#include "colmap_graphmatch/ranking/hamming_distances.h"

// The kernel as it is written in the headers, in double precision with one loop an index, beside
// what is fast.

namespace colmap_graphmatch {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::ValuesIn;

constexpr Eigen::Index kDim = 128;

std::vector<std::uint8_t> RandomDescriptors(std::size_t num, std::uint64_t seed) {
  Random random({seed});
  std::vector<std::uint8_t> descriptors(num * kDim);
  for (std::uint8_t& entry : descriptors) {
    entry = static_cast<std::uint8_t>(random.Index(4) == 0 ? random.Index(256) : random.Index(20));
  }
  return descriptors;
}

RowMatrixXf RandomSamples(std::size_t num, std::uint64_t seed) {
  return RootSift(RandomDescriptors(num, seed).data(), num);
}

double SquaredDistance(const Eigen::Ref<const RowMatrixXf>& a, Eigen::Index i,
                       const Eigen::Ref<const RowMatrixXf>& b, Eigen::Index j) {
  double sum = 0;
  for (Eigen::Index d = 0; d < a.cols(); ++d) {
    sum += std::pow(static_cast<double>(a(i, d)) - static_cast<double>(b(j, d)), 2);
  }
  return sum;
}

// The nearest of the centres; in *margin how much farther the next one is.
std::uint32_t ReferenceNearest(const RowMatrixXf& samples, Eigen::Index i,
                               const Eigen::Ref<const RowMatrixXf>& centers, double* margin) {
  std::vector<std::pair<double, std::uint32_t>> order;
  for (Eigen::Index k = 0; k < centers.rows(); ++k) {
    order.emplace_back(SquaredDistance(samples, i, centers, k), k);
  }
  std::sort(order.begin(), order.end());
  *margin = order.size() > 1 ? order[1].first - order[0].first : 1;
  return order[0].second;
}

class AsmkTargetTest : public ::testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam()); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
};

std::string NameOfTarget(const ::testing::TestParamInfo<std::int64_t>& info) {
  return hwy::TargetName(info.param);
}

INSTANTIATE_TEST_SUITE_P(Targets, AsmkTargetTest, ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         NameOfTarget);

TEST_P(AsmkTargetTest, HammingDistancesAreThoseOfTheReference) {
  Random random({1});
  for (const std::size_t num : {0u, 1u, 2u, 3u, 7u, 8u, 9u, 100u}) {
    const Signs query = {random.Next(), random.Next()};
    std::vector<std::uint64_t> low;
    std::vector<std::uint64_t> high;
    for (std::size_t i = 0; i < num; ++i) {
      low.push_back(i == 0 ? query[0] : i == 1 ? ~query[0] : random.Next());
      high.push_back(i == 0 ? query[1] : i == 1 ? ~query[1] : random.Next());
    }
    std::vector<std::uint64_t> distances(num + 1, 999);
    HammingDistances(query, low.data(), high.data(), num, distances.data());
    for (std::size_t i = 0; i < num; ++i) {
      EXPECT_EQ(distances[i], std::bitset<64>(low[i] ^ query[0]).count() +
                                  std::bitset<64>(high[i] ^ query[1]).count());
    }
    EXPECT_EQ(distances[num], 999U);
  }
}

TEST_P(AsmkTargetTest, TheNearestCenterIsThatOfTheReference) {
  const RowMatrixXf samples = RandomSamples(400, 2);
  for (const std::size_t num_centers : {1u, 2u, 15u, 16u, 17u, 63u, 64u, 65u, 200u}) {
    const RowMatrixXf centers = RandomSamples(num_centers, 3);
    const NearestCenter nearest_center(centers);
    std::vector<std::uint32_t> nearest(400);
    nearest_center.Find(samples.data(), 400, nearest.data());
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      double margin = 0;
      const std::uint32_t expected = ReferenceNearest(samples, row, centers, &margin);
      if (margin > 1e-5) {
        ASSERT_EQ(nearest[i], expected) << num_centers << " " << i;
      }
      std::uint32_t alone = 0;
      nearest_center.Find(samples.row(row).data(), 1, &alone);
      ASSERT_EQ(alone, nearest[i]);
    }
  }
}

TEST(NearestCenter, OfEquallyNearOnesIsTheFirst) {
  const RowMatrixXf centers = RandomSamples(1, 4).replicate(100, 1);
  std::vector<std::uint32_t> nearest(50, 7);
  NearestCenter(centers).Find(RandomSamples(50, 5).data(), 50, nearest.data());
  EXPECT_THAT(nearest, Each(0U));
}

// One iteration from the given centres.
RowMatrixXf ReferenceIteration(const RowMatrixXf& samples, const RowMatrixXf& centers) {
  RowMatrixXd sums = RowMatrixXd::Zero(centers.rows(), centers.cols());
  std::vector<double> counts(static_cast<std::size_t>(centers.rows()));
  for (Eigen::Index i = 0; i < samples.rows(); ++i) {
    double margin = 0;
    const std::uint32_t nearest = ReferenceNearest(samples, i, centers, &margin);
    sums.row(nearest) += samples.row(i).cast<double>();
    ++counts[nearest];
  }
  for (Eigen::Index k = 0; k < centers.rows(); ++k) {
    sums.row(k) /= counts[static_cast<std::size_t>(k)];
  }
  return sums.cast<float>();
}

TEST(LearnCenters, AnIterationIsThatOfTheReference) {
  ThreadPool threads(2);
  const RowMatrixXf samples = RandomSamples(5000, 6);
  const auto learn = [&](int num_iterations) {
    return LearnCenters(samples, 5, num_iterations, Random({1}), &threads, nullptr);
  };
  for (const int num_iterations : {0, 1, 4}) {
    const RowMatrixXf expected = ReferenceIteration(samples, learn(num_iterations));
    ASSERT_EQ(expected.rows(), 5);
    // A sample between two centres may count for either.
    EXPECT_LT((learn(num_iterations + 1) - expected).cwiseAbs().maxCoeff(), 1e-4F);
  }
}

TEST(LearnCenters, OfFewDifferentSamplesAreFewer) {
  RowMatrixXf samples(60, kDim);
  const RowMatrixXf three = RandomSamples(3, 7);
  for (Eigen::Index i = 0; i < samples.rows(); ++i) samples.row(i) = three.row(i % 3);
  const RowMatrixXf centers = LearnCenters(samples, 40, 10, Random({1}), nullptr, nullptr);
  ASSERT_EQ(centers.rows(), 3);
  for (Eigen::Index i = 0; i < 3; ++i) {
    std::set<double> distances;
    for (Eigen::Index k = 0; k < 3; ++k) distances.insert(SquaredDistance(three, i, centers, k));
    EXPECT_EQ(*distances.begin(), 0);
  }
  EXPECT_EQ(LearnCenters(three.topRows(1), 40, 10, Random({1}), nullptr, nullptr),
            three.topRows(1));
}

TEST(RootSift, DividesBySumsAndTakesRoots) {
  std::vector<std::uint8_t> descriptors = RandomDescriptors(20, 8);
  std::fill_n(descriptors.begin(), kDim, std::uint8_t{0});
  std::fill_n(descriptors.begin() + kDim, kDim, std::uint8_t{255});
  const RowMatrixXf rows = RootSift(descriptors.data(), 20);
  for (std::size_t i = 0; i < 20; ++i) {
    double sum = 0;
    for (std::size_t d = 0; d < kDim; ++d) sum += descriptors[i * kDim + d];
    for (std::size_t d = 0; d < kDim; ++d) {
      const double expected = sum > 0 ? std::sqrt(descriptors[i * kDim + d] / sum) : 0;
      EXPECT_NEAR(
          static_cast<double>(rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(d))),
          expected, 1e-6);
    }
  }
}

Vocabulary Learn(const RowMatrixXf& samples, int num_threads = 2, std::uint64_t seed = 0,
                 const VocabularyOptions& options = {}) {
  ThreadPool threads(num_threads);
  return LearnVocabulary(options, seed, samples, threads);
}

void ExpectValid(const Vocabulary& vocabulary) {
  ASSERT_THAT(vocabulary.first_words,
              SizeIs(static_cast<std::size_t>(vocabulary.cells.rows()) + 1));
  EXPECT_EQ(vocabulary.first_words.front(), 0U);
  EXPECT_EQ(vocabulary.first_words.back(), vocabulary.words.rows());
  for (std::size_t cell = 0; cell + 1 < vocabulary.first_words.size(); ++cell) {
    EXPECT_LT(vocabulary.first_words[cell], vocabulary.first_words[cell + 1]);
  }
  EXPECT_TRUE(vocabulary.cells.allFinite() && vocabulary.words.allFinite());
}

TEST(LearnVocabulary, HasAsManyWordsAsTheSamplesAreWorth) {
  for (const std::size_t num : {1u, 2u, 4u, 5u, 255u, 256u, 257u, 3000u}) {
    const Vocabulary vocabulary = Learn(RandomSamples(num, 9));
    ExpectValid(vocabulary);
    EXPECT_LE(vocabulary.cells.rows(), static_cast<Eigen::Index>(num + 255) / 256);
    EXPECT_LE(vocabulary.words.rows(),
              static_cast<Eigen::Index>(num + 3) / 4 + vocabulary.cells.rows());
    EXPECT_GE(vocabulary.words.rows(), static_cast<Eigen::Index>(num) / 8);
  }
  VocabularyOptions options;
  options.num_cells = 3;
  options.num_words_per_cell = 5;
  const Vocabulary vocabulary = Learn(RandomSamples(1000, 10), 2, 0, options);
  EXPECT_EQ(vocabulary.cells.rows(), 3);
  EXPECT_EQ(vocabulary.words.rows(), 15);
}

TEST(LearnVocabulary, EqualSamplesAreOneWord) {
  const Vocabulary vocabulary = Learn(RandomSamples(1, 11).replicate(5000, 1));
  ExpectValid(vocabulary);
  EXPECT_EQ(vocabulary.words, RandomSamples(1, 11));
}

TEST(LearnVocabulary, IsBitwiseTheSameOnAnyNumberOfThreads) {
  const RowMatrixXf samples = RandomSamples(9000, 12);
  const Vocabulary expected = Learn(samples, 1);
  for (const int num_threads : {2, 3}) {
    const Vocabulary vocabulary = Learn(samples, num_threads);
    EXPECT_EQ(vocabulary.cells, expected.cells);
    EXPECT_EQ(vocabulary.words, expected.words);
    EXPECT_EQ(vocabulary.first_words, expected.first_words);
  }
  EXPECT_NE(Learn(samples, 1, 1).cells, expected.cells);
}

TEST(LearnVocabulary, StopsOnRequest) {
  ThreadPool threads(1);
  StopRequest stop;
  stop.Raise();
  EXPECT_THROW(LearnVocabulary({}, 0, RandomSamples(100, 13), threads, &stop), StoppedError);
}

TEST(VocabularyOptions, TheSeedAndEveryFieldChangeTheKey) {
  std::set<std::string> keys = {VocabularyOptions().Key(0), VocabularyOptions().Key(1)};
  for (int VocabularyOptions::*field :
       {&VocabularyOptions::num_cells, &VocabularyOptions::num_words_per_cell,
        &VocabularyOptions::num_training_descriptors, &VocabularyOptions::num_iterations,
        &VocabularyOptions::num_samples_per_cell, &VocabularyOptions::min_samples_per_word}) {
    VocabularyOptions options;
    options.*field = 7;
    keys.insert(options.Key(0));
  }
  EXPECT_THAT(keys, SizeIs(8));
}

TEST_P(AsmkTargetTest, WordsAndSignsAreThoseOfTheReference) {
  const Vocabulary vocabulary = Learn(RandomSamples(2000, 14));
  const RowMatrixXf descriptors = RandomSamples(700, 15);
  std::map<std::uint32_t, Eigen::RowVectorXd> sums;
  std::set<std::uint32_t> unsure;  // Words that rounding may have decided.
  for (Eigen::Index i = 0; i < descriptors.rows(); ++i) {
    double margin = 0;
    const std::uint32_t cell = ReferenceNearest(descriptors, i, vocabulary.cells, &margin);
    const std::uint32_t first = vocabulary.first_words[cell];
    const Eigen::Index count = vocabulary.first_words[cell + 1] - first;
    double margin_in_cell = 0;
    const std::uint32_t word =
        first + ReferenceNearest(descriptors, i, vocabulary.words.middleRows(first, count),
                                 &margin_in_cell);
    if (std::min(margin, margin_in_cell) < 1e-5) unsure.insert(word);
    Eigen::RowVectorXd& sum = sums[word];
    if (sum.size() == 0) sum = Eigen::RowVectorXd::Zero(kDim);
    sum += descriptors.row(i).cast<double>() - vocabulary.words.row(word).cast<double>();
  }
  ASSERT_THAT(unsure, IsEmpty());
  const VisualWords encoded = VisualWordEncoder(vocabulary).Encode(descriptors);
  ASSERT_THAT(encoded.words, SizeIs(sums.size()));
  ASSERT_THAT(encoded.signs, SizeIs(sums.size()));
  std::size_t i = 0;
  for (const auto& [word, sum] : sums) {
    ASSERT_EQ(encoded.words[i], word);
    for (Eigen::Index d = 0; d < kDim; ++d) {
      if (std::abs(sum[d]) < 1e-5) continue;
      const std::uint64_t half = encoded.signs[i][static_cast<std::size_t>(d) / 64];
      ASSERT_EQ((half >> (d % 64)) & 1, sum[d] > 0 ? 1U : 0U) << word << " " << d;
    }
    ++i;
  }
}

TEST(VisualWordEncoder, FewAndEqualDescriptors) {
  const RowMatrixXf one = RandomSamples(1, 16);
  const Vocabulary vocabulary = Learn(one);
  const VisualWordEncoder encoder(vocabulary);
  const VisualWords expected = encoder.Encode(one);
  EXPECT_THAT(expected.words, ElementsAre(0U));
  EXPECT_THAT(expected.signs, ElementsAre(Signs{0, 0}));
  EXPECT_EQ(encoder.Encode(one.replicate(999, 1)).signs, expected.signs);
  EXPECT_THAT(encoder.Encode(RandomSamples(999, 17)).words, ElementsAre(0U));
  EXPECT_THAT(encoder.Encode(RowMatrixXf(0, kDim)).words, IsEmpty());
}

// Images that share words, and signs that are alike.
std::vector<VisualWords> RandomImages(std::size_t num_images, std::uint32_t num_words,
                                      std::uint64_t seed) {
  Random random({seed});
  std::vector<VisualWords> images(num_images);
  for (VisualWords& image : images) {
    for (std::uint32_t word = 0; word < num_words; ++word) {
      if (random.Index(3) != 0) continue;
      image.words.push_back(word);
      // Differs from the word's own signs in a quarter of the bits, or in half of them.
      Signs signs = {word * 0x9E3779B97F4A7C15ull, ~(word * 0xBF58476D1CE4E5B9ull)};
      for (std::uint64_t& half : signs) {
        half ^= random.Index(2) == 0 ? random.Next() : random.Next() & random.Next();
      }
      image.signs.push_back(signs);
    }
  }
  return images;
}

class ReferenceKernel {
 public:
  explicit ReferenceKernel(const std::vector<VisualWords>& images) : images_(images) {
    for (const VisualWords& image : images) {
      for (const std::uint32_t word : image.words) ++num_with_word_[word];
    }
  }

  double Distance(std::size_t a, std::size_t b) const {
    const double norm = std::sqrt(Sum(a, a) * Sum(b, b));
    return norm > 0 ? 1 - Sum(a, b) / norm : 1;
  }

 private:
  double Sum(std::size_t a, std::size_t b) const {
    double sum = 0;
    for (std::size_t i = 0; i < images_[a].words.size(); ++i) {
      for (std::size_t j = 0; j < images_[b].words.size(); ++j) {
        const std::uint32_t word = images_[a].words[i];
        if (images_[b].words[j] != word) continue;
        int product = 0;
        for (std::size_t d = 0; d < 128; ++d) {
          const auto bit = [d](const Signs& signs) { return (signs[d / 64] >> (d % 64)) & 1; };
          product += bit(images_[a].signs[i]) == bit(images_[b].signs[j]) ? 1 : -1;
        }
        const double u = std::max(product, 0) / 128.0;
        const double idf =
            std::log((static_cast<double>(images_.size()) + 1) / num_with_word_.at(word));
        sum += idf * u * u * u;
      }
    }
    return sum;
  }

  const std::vector<VisualWords>& images_;
  std::map<std::uint32_t, double> num_with_word_;
};

AsmkRanking MakeRanking(const std::vector<VisualWords>& images, std::size_t list_length = 512,
                        int num_threads = 2) {
  ThreadPool threads(num_threads);
  RankingOptions options;
  options.list_length = list_length;
  return AsmkRanking(options, images, threads);
}

// By the distances that the ranking says, ties by ascending number.
std::vector<Vertex> SortedOthers(const Ranking& ranking, Vertex vertex) {
  std::vector<std::pair<float, Vertex>> order;
  for (Vertex other = 0; other < ranking.NumVertices(); ++other) {
    if (other != vertex) order.emplace_back(ranking.Distance(vertex, other), other);
  }
  std::sort(order.begin(), order.end());
  std::vector<Vertex> sorted;
  for (const auto& [distance, other] : order) sorted.push_back(other);
  return sorted;
}

TEST_P(AsmkTargetTest, DistancesAndListsAreThoseOfTheReference) {
  std::vector<VisualWords> images = RandomImages(60, 40, 18);
  images[7] = images[33];
  images[12] = {{5}, {{1, 2}}};
  images[13] = {{50}, {{1, 2}}};
  images[14] = {};
  const ReferenceKernel reference(images);
  for (const std::size_t list_length : {0u, 5u, 512u}) {
    const AsmkRanking ranking = MakeRanking(images, list_length);
    ASSERT_EQ(ranking.NumVertices(), images.size());
    for (Vertex a = 0; a < images.size(); ++a) {
      for (Vertex b = 0; b < images.size(); ++b) {
        const float distance = ranking.Distance(a, b);
        EXPECT_NEAR(static_cast<double>(distance), reference.Distance(a, b), 1e-5);
        EXPECT_EQ(distance, ranking.Distance(b, a));
        EXPECT_TRUE(distance >= 0 && distance <= 1);
      }
      std::vector<Vertex> expected = SortedOthers(ranking, a);
      ASSERT_EQ(ranking.AllOf(a), expected);
      expected.resize(std::min(list_length, expected.size()));
      ASSERT_EQ(ranking.NearestOf(a), expected);
    }
    EXPECT_EQ(ranking.Distance(7, 33), 0);
    EXPECT_EQ(ranking.Distance(3, 3), 0);
    EXPECT_EQ(ranking.Distance(14, 14), 1);
  }
}

// More images of a word than are scored at a time.
TEST_P(AsmkTargetTest, IsBitwiseTheSameForAnyNumberOfThreadsAndListLength) {
  const std::vector<VisualWords> images = RandomImages(900, 8, 19);
  const AsmkRanking expected = MakeRanking(images, 0, 1);
  for (const int num_threads : {2, 3}) {
    const AsmkRanking ranking = MakeRanking(images, 300, num_threads);
    for (Vertex vertex = 0; vertex < images.size(); vertex += 10) {
      std::vector<Vertex> all = expected.AllOf(vertex);
      ASSERT_EQ(ranking.AllOf(vertex), all);
      ASSERT_EQ(SortedOthers(ranking, vertex), all);
      all.resize(300);
      ASSERT_EQ(ranking.NearestOf(vertex), all);
      for (Vertex other = 0; other < images.size(); other += 7) {
        ASSERT_EQ(ranking.Distance(vertex, other), expected.Distance(vertex, other));
      }
    }
  }
}

TEST(AsmkRanking, EqualImagesHaveNoDistanceHoweverFewTheyAre) {
  const std::vector<VisualWords> images = RandomImages(1, 30, 20);
  EXPECT_EQ(MakeRanking(images).Distance(0, 0), 0);
  const AsmkRanking two = MakeRanking({images[0], images[0]});
  EXPECT_EQ(two.Distance(0, 1), 0);
  EXPECT_THAT(two.NearestOf(1), ElementsAre(0U));
  const AsmkRanking many = MakeRanking({images[0], images[0], images[0], images[0]}, 2);
  EXPECT_THAT(many.NearestOf(2), ElementsAre(0U, 1U));
  EXPECT_THAT(many.AllOf(1), ElementsAre(0U, 2U, 3U));
}

TEST(AsmkRanking, ThoseWithoutACommonWordComeLastByNumber) {
  const Signs signs = {3, 4};
  const AsmkRanking ranking =
      MakeRanking({{{0}, {signs}}, {{1}, {signs}}, {}, {{0, 1}, {signs, signs}}, {{2}, {signs}}});
  EXPECT_THAT(ranking.NearestOf(0), ElementsAre(3U, 1U, 2U, 4U));
  EXPECT_THAT(ranking.NearestOf(2), ElementsAre(0U, 1U, 3U, 4U));
  EXPECT_EQ(ranking.Distance(0, 1), 1);
  EXPECT_EQ(ranking.Distance(2, 2), 1);
}

TEST(AsmkRanking, FewImages) {
  EXPECT_EQ(MakeRanking({}).NumVertices(), 0U);
  const AsmkRanking one = MakeRanking({{}});
  EXPECT_THAT(one.NearestOf(0), IsEmpty());
  EXPECT_THAT(one.AllOf(0), IsEmpty());
}

TEST(AsmkRanking, StopsOnRequest) {
  ThreadPool threads(1);
  StopRequest stop;
  stop.Raise();
  EXPECT_THROW(AsmkRanking({}, RandomImages(3, 5, 21), threads, &stop), StoppedError);
}

}  // namespace
}  // namespace colmap_graphmatch
