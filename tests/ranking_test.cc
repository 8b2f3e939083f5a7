#include "colmap_graphmatch/ranking/ranking.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/ranking/dot_products.h"

namespace colmap_graphmatch {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::IsNan;
using ::testing::ValuesIn;

// Every instruction set of this processor that the code was compiled for.
class RankingTest : public ::testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam()); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
};

using DotProductsTest = RankingTest;

std::string NameOfTarget(const ::testing::TestParamInfo<std::int64_t>& info) {
  return hwy::TargetName(info.param);
}

INSTANTIATE_TEST_SUITE_P(Targets, DotProductsTest, ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         NameOfTarget);
INSTANTIATE_TEST_SUITE_P(Targets, RankingTest, ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         NameOfTarget);

// Around the blocks of 48 rows and their tiles of 4 x 3, and around the slices of 512 columns.
constexpr std::size_t kNumRows[] = {1, 2, 3, 47, 48, 49, 100};
constexpr std::size_t kMaxNumRows = 100;
constexpr std::size_t kDims[] = {16, 512, 528, 4096};

std::vector<float> RandomNumbers(std::size_t count, std::uint64_t seed) {
  Random random({seed});
  std::vector<float> numbers(count);
  for (float& number : numbers) number = static_cast<float>(2 * random.Uniform() - 1);
  return numbers;
}

// Small whole numbers: their products and sums have no rounding errors.
std::vector<float> RandomWholeNumbers(std::size_t count, std::uint64_t seed) {
  Random random({seed});
  std::vector<float> numbers(count);
  for (float& number : numbers) {
    number = static_cast<float>(static_cast<int>(random.Index(17)) - 8);
  }
  return numbers;
}

float SingleProduct(const float* a, const float* b, std::size_t dim) {
  float product = std::numeric_limits<float>::quiet_NaN();
  DotProducts(a, 1, b, 1, dim, &product, 1);
  return product;
}

TEST_P(DotProductsTest, RunsOnTheTargetThatIsTested) {
  const std::vector<float> ones(16, 1);
  EXPECT_EQ(SingleProduct(ones.data(), ones.data(), 16), 16);
  if (hwy::SupportedTargets() == GetParam() && hwy::GetChosenTarget().IsInitialized()) {
    hwy::ChosenTarget expected;
    expected.Update(GetParam());
    EXPECT_EQ(hwy::GetChosenTarget().GetIndex(), expected.GetIndex());
  }
}

TEST_P(DotProductsTest, AreThoseOfTheReference) {
  for (const std::size_t dim : kDims) {
    const std::vector<float> a = RandomNumbers(kMaxNumRows * dim, 1);
    const std::vector<float> b = RandomNumbers(kMaxNumRows * dim, 2);
    std::vector<float> products(kMaxNumRows * kMaxNumRows);
    DotProducts(a.data(), kMaxNumRows, b.data(), kMaxNumRows, dim, products.data(), kMaxNumRows);
    for (std::size_t i = 0; i < kMaxNumRows; ++i) {
      for (std::size_t j = 0; j < kMaxNumRows; ++j) {
        double expected = 0;
        double magnitude = 0;
        for (std::size_t d = 0; d < dim; ++d) {
          const double product =
              static_cast<double>(a[i * dim + d]) * static_cast<double>(b[j * dim + d]);
          expected += product;
          magnitude += std::abs(product);
        }
        ASSERT_NEAR(static_cast<double>(products[i * kMaxNumRows + j]), expected, 1e-6 * magnitude)
            << dim << ": " << i << ", " << j;
      }
    }
  }
}

TEST_P(DotProductsTest, AreExactForWholeNumbers) {
  for (const std::size_t dim : kDims) {
    const std::vector<float> a = RandomWholeNumbers(kMaxNumRows * dim, 3);
    const std::vector<float> b = RandomWholeNumbers(kMaxNumRows * dim, 4);
    std::vector<float> products(kMaxNumRows * kMaxNumRows);
    DotProducts(a.data(), kMaxNumRows, b.data(), kMaxNumRows, dim, products.data(), kMaxNumRows);
    for (std::size_t i = 0; i < kMaxNumRows; ++i) {
      for (std::size_t j = 0; j < kMaxNumRows; ++j) {
        float expected = 0;
        for (std::size_t d = 0; d < dim; ++d) expected += a[i * dim + d] * b[j * dim + d];
        ASSERT_EQ(products[i * kMaxNumRows + j], expected) << dim << ": " << i << ", " << j;
      }
    }
  }
}

TEST_P(DotProductsTest, OfABlockAreBitwiseThoseOfSinglePairs) {
  for (const std::size_t dim : kDims) {
    const std::vector<float> a = RandomNumbers(kMaxNumRows * dim, 5);
    const std::vector<float> b = RandomNumbers(kMaxNumRows * dim, 6);
    std::vector<float> singles(kMaxNumRows * kMaxNumRows);
    for (std::size_t i = 0; i < kMaxNumRows; ++i) {
      for (std::size_t j = 0; j < kMaxNumRows; ++j) {
        singles[i * kMaxNumRows + j] = SingleProduct(a.data() + i * dim, b.data() + j * dim, dim);
      }
    }
    for (const std::size_t num_a : kNumRows) {
      for (const std::size_t num_b : kNumRows) {
        // Wider rows than there are products; what was there before must not matter.
        const std::size_t stride = num_b + 3;
        std::vector<float> products(num_a * stride, std::numeric_limits<float>::quiet_NaN());
        DotProducts(a.data(), num_a, b.data(), num_b, dim, products.data(), stride);
        for (std::size_t i = 0; i < num_a; ++i) {
          for (std::size_t j = 0; j < num_b; ++j) {
            ASSERT_EQ(products[i * stride + j], singles[i * kMaxNumRows + j])
                << num_a << " x " << num_b << " x " << dim << " at " << i << ", " << j;
          }
          for (std::size_t j = num_b; j < stride; ++j) {
            ASSERT_THAT(products[i * stride + j], IsNan());
          }
        }
      }
    }
  }
}

TEST_P(DotProductsTest, AreBitwiseSymmetric) {
  for (const std::size_t dim : kDims) {
    const std::vector<float> a = RandomNumbers(kMaxNumRows * dim, 7);
    std::vector<float> products(kMaxNumRows * kMaxNumRows);
    DotProducts(a.data(), kMaxNumRows, a.data(), kMaxNumRows, dim, products.data(), kMaxNumRows);
    for (std::size_t i = 0; i < kMaxNumRows; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        ASSERT_EQ(products[i * kMaxNumRows + j], products[j * kMaxNumRows + i])
            << dim << ": " << i << ", " << j;
      }
    }
  }
}

std::vector<float> UnitVectors(std::size_t num_vectors, std::size_t dim, std::uint64_t seed) {
  std::vector<float> vectors = RandomNumbers(num_vectors * dim, seed);
  for (std::size_t i = 0; i < num_vectors; ++i) {
    double squared_norm = 0;
    for (std::size_t d = 0; d < dim; ++d) {
      squared_norm += std::pow(static_cast<double>(vectors[i * dim + d]), 2);
    }
    for (std::size_t d = 0; d < dim; ++d) {
      vectors[i * dim + d] =
          static_cast<float>(static_cast<double>(vectors[i * dim + d]) / std::sqrt(squared_norm));
    }
  }
  return vectors;
}

// Four entries of +-1/2 and otherwise zeros: unit vectors whose distances have no rounding errors
// and are often equal.
std::vector<float> UnitVectorsWithTies(std::size_t num_vectors, std::size_t dim,
                                       std::uint64_t seed) {
  Random random({seed});
  std::vector<float> vectors(num_vectors * dim);
  for (std::size_t i = 0; i < num_vectors; ++i) {
    for (int num_entries = 0; num_entries < 4;) {
      float& entry = vectors[i * dim + random.Index(dim)];
      if (entry != 0) continue;
      entry = random.Index(2) == 0 ? 0.5F : -0.5F;
      ++num_entries;
    }
  }
  return vectors;
}

VectorRanking MakeRanking(std::size_t num_vertices, std::size_t dim,
                          const std::vector<float>& vectors, std::size_t list_length = 512,
                          int num_threads = 2) {
  ThreadPool threads(num_threads);
  RankingOptions options;
  options.list_length = list_length;
  return VectorRanking(options, num_vertices, dim, vectors, threads);
}

double ReferenceDistance(const std::vector<float>& vectors, std::size_t dim, Vertex a, Vertex b) {
  double sum = 0;
  for (std::size_t d = 0; d < dim; ++d) {
    sum += std::pow(
        static_cast<double>(vectors[a * dim + d]) - static_cast<double>(vectors[b * dim + d]), 2);
  }
  return sum;
}

TEST_P(RankingTest, DistancesAreThoseOfTheReference) {
  constexpr std::size_t kNumVertices = 30;
  for (const std::size_t dim : {1u, 15u, 16u, 33u, 600u, 4096u}) {
    const std::vector<float> vectors = UnitVectors(kNumVertices, dim, 11);
    const VectorRanking ranking = MakeRanking(kNumVertices, dim, vectors);
    ASSERT_EQ(ranking.NumVertices(), kNumVertices);
    for (Vertex a = 0; a < kNumVertices; ++a) {
      for (Vertex b = 0; b < kNumVertices; ++b) {
        EXPECT_NEAR(static_cast<double>(ranking.Distance(a, b)),
                    ReferenceDistance(vectors, dim, a, b), 2e-6);
        EXPECT_EQ(ranking.Distance(a, b), ranking.Distance(b, a));
      }
      EXPECT_NEAR(ranking.Distance(a, a), 0, 2e-6);
    }
  }
}

TEST_P(RankingTest, ListsAreSortedByDistanceThenByNumber) {
  for (const std::size_t num_vertices : {3u, 48u, 97u, 150u}) {
    for (const std::size_t dim : {16u, 20u, 33u, 530u}) {
      SCOPED_TRACE(::testing::Message() << "N=" << num_vertices << " dim=" << dim);
      std::vector<float> vectors = UnitVectorsWithTies(num_vertices, dim, 12);
      // Duplicates across the blocks of rows.
      for (std::size_t i = 0; i < num_vertices; i += 7) {
        std::copy_n(vectors.begin(), dim, vectors.begin() + static_cast<std::ptrdiff_t>(i * dim));
      }
      const VectorRanking ranking = MakeRanking(num_vertices, dim, vectors);
      for (Vertex vertex = 0; vertex < num_vertices; ++vertex) {
        std::vector<std::pair<double, Vertex>> order;
        for (Vertex other = 0; other < num_vertices; ++other) {
          if (other == vertex) continue;
          const double distance = ReferenceDistance(vectors, dim, vertex, other);
          ASSERT_EQ(static_cast<double>(ranking.Distance(vertex, other)), distance);
          order.emplace_back(distance, other);
        }
        std::sort(order.begin(), order.end());
        std::vector<Vertex> expected;
        for (const auto& [distance, other] : order) expected.push_back(other);
        ASSERT_EQ(ranking.NearestOf(vertex), expected) << vertex;
        ASSERT_EQ(ranking.AllOf(vertex), expected) << vertex;
      }
    }
  }
}

// Lists come from products of blocks, and loops compare them with products of single pairs.
TEST_P(RankingTest, ListsAgreeWithDistancesComputedOneByOne) {
  constexpr std::size_t kNumVertices = 130;
  for (const std::size_t dim : {16u, 50u, 1040u}) {
    SCOPED_TRACE(dim);
    std::vector<float> vectors = UnitVectors(kNumVertices, dim, 13);
    // Almost duplicates, whose distances differ by rounding errors only.
    for (std::size_t i = 1; i < kNumVertices; i += 3) {
      for (std::size_t d = 0; d < dim; ++d) vectors[i * dim + d] = vectors[d];
      vectors[i * dim + i % dim] = std::nextafter(vectors[i % dim], 2.0F);
    }
    const std::size_t padded_dim = (dim + kRowPadding - 1) / kRowPadding * kRowPadding;
    std::vector<float> padded(kNumVertices * padded_dim);
    for (std::size_t i = 0; i < kNumVertices; ++i) {
      for (std::size_t d = 0; d < dim; ++d) padded[i * padded_dim + d] = vectors[i * dim + d];
    }
    const VectorRanking ranking = MakeRanking(kNumVertices, dim, vectors);
    for (Vertex vertex = 0; vertex < kNumVertices; ++vertex) {
      std::vector<std::pair<float, Vertex>> order;
      for (Vertex other = 0; other < kNumVertices; ++other) {
        if (other == vertex) continue;
        order.emplace_back(-SingleProduct(padded.data() + vertex * padded_dim,
                                          padded.data() + other * padded_dim, padded_dim),
                           other);
      }
      std::sort(order.begin(), order.end());
      const std::vector<Vertex>& nearest = ranking.NearestOf(vertex);
      ASSERT_EQ(nearest.size(), order.size());
      for (std::size_t i = 0; i < order.size(); ++i) {
        ASSERT_EQ(nearest[i], order[i].second) << vertex << " " << i;
        if (i == 0) continue;
        ASSERT_LE(ranking.Distance(vertex, nearest[i - 1]), ranking.Distance(vertex, nearest[i]));
        ASSERT_LE(ReferenceDistance(vectors, dim, vertex, nearest[i - 1]),
                  ReferenceDistance(vectors, dim, vertex, nearest[i]) + 2e-6);
      }
    }
  }
}

TEST_P(RankingTest, ShortListsAreTheBeginningOfTheLongOnes) {
  constexpr std::size_t kNumVertices = 100;
  constexpr std::size_t kDim = 24;
  const std::vector<float> vectors = UnitVectorsWithTies(kNumVertices, kDim, 14);
  for (const std::size_t list_length : {0u, 1u, 2u, 50u, 98u, 99u, 100u, 1000u}) {
    const VectorRanking ranking = MakeRanking(kNumVertices, kDim, vectors, list_length);
    for (Vertex vertex = 0; vertex < kNumVertices; ++vertex) {
      std::vector<Vertex> all = ranking.AllOf(vertex);
      ASSERT_EQ(all.size(), kNumVertices - 1);
      all.resize(std::min(list_length, kNumVertices - 1));
      ASSERT_EQ(ranking.NearestOf(vertex), all) << list_length << " " << vertex;
    }
  }
}

TEST_P(RankingTest, IsTheSameForAnyNumberOfThreads) {
  constexpr std::size_t kNumVertices = 500;
  constexpr std::size_t kDim = 100;
  const std::vector<float> vectors = UnitVectors(kNumVertices, kDim, 15);
  const VectorRanking expected = MakeRanking(kNumVertices, kDim, vectors, 40, 1);
  for (const int num_threads : {2, 3, 16}) {
    const VectorRanking ranking = MakeRanking(kNumVertices, kDim, vectors, 40, num_threads);
    for (Vertex vertex = 0; vertex < kNumVertices; ++vertex) {
      ASSERT_EQ(ranking.NearestOf(vertex), expected.NearestOf(vertex)) << num_threads;
    }
  }
}

TEST_P(RankingTest, VectorsThatAreAllEqualAreRankedByNumber) {
  constexpr std::size_t kNumVertices = 60;
  std::vector<float> vectors;
  for (std::size_t i = 0; i < kNumVertices; ++i) {
    vectors.insert(vectors.end(), {0.6F, 0.8F, 0});
  }
  const VectorRanking ranking = MakeRanking(kNumVertices, 3, vectors, 5);
  EXPECT_THAT(ranking.NearestOf(0), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_THAT(ranking.NearestOf(3), ElementsAre(0, 1, 2, 4, 5));
  EXPECT_THAT(ranking.NearestOf(59), ElementsAre(0, 1, 2, 3, 4));
}

TEST_P(RankingTest, OneVertexHasNoOthers) {
  const VectorRanking ranking = MakeRanking(1, 3, {1, 0, 0});
  EXPECT_EQ(ranking.NumVertices(), 1u);
  EXPECT_THAT(ranking.NearestOf(0), IsEmpty());
  EXPECT_THAT(ranking.AllOf(0), IsEmpty());
  EXPECT_EQ(ranking.Distance(0, 0), 0);
}

TEST_P(RankingTest, TwoVerticesHaveEachOther) {
  const VectorRanking ranking = MakeRanking(2, 2, {1, 0, -1, 0});
  EXPECT_THAT(ranking.NearestOf(0), ElementsAre(1));
  EXPECT_THAT(ranking.NearestOf(1), ElementsAre(0));
  EXPECT_THAT(ranking.AllOf(0), ElementsAre(1));
  EXPECT_EQ(ranking.Distance(0, 1), 4);
  EXPECT_EQ(ranking.Distance(1, 0), 4);
}

TEST_P(RankingTest, NoVerticesAreAllowed) { EXPECT_EQ(MakeRanking(0, 3, {}).NumVertices(), 0u); }

TEST(RankingStopTest, StopsOnRequest) {
  const std::vector<float> vectors = UnitVectors(100, 16, 16);
  ThreadPool threads(2);
  StopRequest stop;
  EXPECT_EQ(VectorRanking({}, 100, 16, vectors, threads, &stop).NumVertices(), 100u);
  stop.Raise();
  EXPECT_THROW(VectorRanking({}, 100, 16, vectors, threads, &stop), StoppedError);
}

TEST(RankingOptionsTest, KeepsLongListsByDefault) { EXPECT_EQ(RankingOptions().list_length, 512u); }

}  // namespace
}  // namespace colmap_graphmatch
