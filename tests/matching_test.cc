#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/matching/descriptor_cache.h"
#include "colmap_graphmatch/matching/descriptor_matcher.h"
#include "colmap_graphmatch/matching/pair_order.h"
#include "colmap_graphmatch/matching/top_two.h"
#include "tests/support/matching_targets.h"
#include "tests/support/reference_matching.h"

namespace colmap_graphmatch {

class DescriptorCachePeer {
 public:
  static std::size_t MaxBytesKept(const DescriptorCache& cache) { return cache.MaxBytesKept(); }
};

void PrintTo(const FeatureMatch& match, std::ostream* stream) {
  *stream << match.feature1 << "-" << match.feature2;
}

namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::SizeIs;
using ::testing::ValuesIn;

class MatchingTest : public ::testing::TestWithParam<MatchingTarget> {
 protected:
  void SetUp() override { GetParam().Use(); }
  void TearDown() override { MatchingTarget().Use(); }
};

std::string NameOfTarget(const ::testing::TestParamInfo<MatchingTarget>& info) {
  // Several of Highway's targets may have the same words for users.
  std::string name = std::string(hwy::TargetName(info.param.target)) + "_" + info.param.Name();
  std::replace(name.begin(), name.end(), ' ', '_');
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Targets, MatchingTest, ValuesIn(MatchingTargets()), NameOfTarget);

using Rows = std::vector<std::uint8_t>;

DescriptorView View(const Rows& rows) { return {rows.data(), rows.size() / kDescriptorDim}; }

Rows UniformRows(std::size_t num, std::uint64_t max, std::uint64_t seed) {
  Random random({seed, max});
  Rows rows(num * kDescriptorDim);
  for (std::uint8_t& entry : rows) entry = static_cast<std::uint8_t>(random.Index(max + 1));
  return rows;
}

// Few large entries, many small ones, of length 512: as SIFT's.
Rows SiftRows(std::size_t num, std::uint64_t seed) {
  Random random({seed});
  Rows rows;
  for (std::size_t i = 0; i < num; ++i) {
    std::vector<double> entries(kDescriptorDim);
    double squares = 0;
    for (double& entry : entries) {
      entry = std::pow(random.Uniform(), 3);
      squares += entry * entry;
    }
    for (const double entry : entries) {
      rows.push_back(
          static_cast<std::uint8_t>(std::min(255.0, std::round(512 * entry / std::sqrt(squares)))));
    }
  }
  return rows;
}

// Rows of `from` in another order, disturbed: some near, some beyond the thresholds.
Rows NoisyCopies(const Rows& from, std::uint64_t seed) {
  Random random({seed, 7});
  const std::size_t num = View(from).num;
  Rows rows;
  for (std::size_t i = 0; i < num; ++i) {
    const std::size_t source = (i * 37 + 11) % num;
    const double noise = 60 * random.Uniform();
    for (std::size_t d = 0; d < kDescriptorDim; ++d) {
      const double value = from[source * kDescriptorDim + d] + noise * (random.Uniform() - 0.5);
      rows.push_back(static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0)));
    }
  }
  return rows;
}

void ExpectAsReference(const Rows& a, const Rows& b, const std::string& what) {
  SCOPED_TRACE(what + ": " + std::to_string(View(a).num) + " x " + std::to_string(View(b).num));
  TopTwoBuffers buffers;
  TopTwo result;
  ComputeTopTwo(View(a), View(b), &buffers, &result);
  ASSERT_THAT(result.best_of_a, SizeIs(View(a).num));
  ASSERT_THAT(result.best_of_b, SizeIs(View(b).num));
  for (std::size_t i = 0; i < View(a).num; ++i) {
    const ReferenceBest expected = ReferenceBestOf(View(a), i, View(b));
    ASSERT_EQ(result.best_of_a[i], expected.best) << "row " << i;
    ASSERT_EQ(result.second_of_a[i], expected.second) << "row " << i;
    ASSERT_EQ(result.best_b[i], static_cast<std::uint32_t>(std::max(expected.index, 0)))
        << "row " << i;
  }
  for (std::size_t j = 0; j < View(b).num; ++j) {
    const ReferenceBest expected = ReferenceBestOf(View(b), j, View(a));
    ASSERT_EQ(result.best_of_b[j], expected.best) << "column " << j;
    ASSERT_EQ(result.second_of_b[j], expected.second) << "column " << j;
  }
}

TEST_P(MatchingTest, TopTwoOfAnyNumberOfRows) {
  // Around tiles of 4, 6 and 12 rows, and vectors of 4, 8 and 16 columns, two at a time.
  for (const std::size_t num_a : {0U, 1U, 5U, 6U, 7U, 12U, 13U}) {
    for (const std::size_t num_b : {0U, 1U, 2U, 7U, 8U, 9U, 31U, 32U, 33U}) {
      ExpectAsReference(UniformRows(num_a, 255, 1), UniformRows(num_b, 255, 2), "uniform");
    }
  }
}

TEST_P(MatchingTest, TopTwoAcrossBlocks) {
  // Blocks are of 64 vectors: 256, 512 or 1024 columns.
  for (const std::size_t num_b : {256U, 257U, 511U, 513U, 1024U, 1025U, 2100U}) {
    ExpectAsReference(SiftRows(17, 3), SiftRows(num_b, 4), "SIFT");
  }
}

TEST_P(MatchingTest, TopTwoOfExtremes) {
  const Rows zeros(40 * kDescriptorDim, 0);
  const Rows full(40 * kDescriptorDim, 255);
  ExpectAsReference(zeros, zeros, "zeros");
  ExpectAsReference(zeros, full, "zeros and the greatest");
  ExpectAsReference(full, zeros, "the greatest and zeros");
  ExpectAsReference(full, full, "the greatest");
  Rows mixed = full;
  mixed.insert(mixed.end(), zeros.begin(), zeros.end());
  ExpectAsReference(mixed, UniformRows(100, 255, 5), "mixed and uniform");
  ExpectAsReference(UniformRows(100, 1, 6), mixed, "bits and mixed");
}

TEST_P(MatchingTest, TopTwoWithTies) {
  // Entries of 0 and 1: products are small numbers, many of them equal.
  ExpectAsReference(UniformRows(60, 1, 8), UniformRows(1100, 1, 9), "bits");
  // Each row many times, in other vectors, lanes and blocks.
  const Rows few = SiftRows(7, 10);
  Rows many;
  for (int i = 0; i < 170; ++i) many.insert(many.end(), few.begin(), few.end());
  ExpectAsReference(many, few, "duplicates on the left");
  ExpectAsReference(few, many, "duplicates on the right");
  ExpectAsReference(many, many, "duplicates on both sides");
}

TEST_P(MatchingTest, BuffersCanBeReused) {
  TopTwoBuffers buffers;
  TopTwo result;
  const Rows large = SiftRows(300, 11);
  const Rows small = SiftRows(9, 12);
  ComputeTopTwo(View(large), View(large), &buffers, &result);
  ComputeTopTwo(View(small), View(small), &buffers, &result);
  TopTwo expected;
  TopTwoBuffers fresh;
  ComputeTopTwo(View(small), View(small), &fresh, &expected);
  EXPECT_EQ(result.best_of_a, expected.best_of_a);
  EXPECT_EQ(result.second_of_a, expected.second_of_a);
  EXPECT_EQ(result.best_b, expected.best_b);
  EXPECT_EQ(result.best_of_b, expected.best_of_b);
  EXPECT_EQ(result.second_of_b, expected.second_of_b);
}

TEST_P(MatchingTest, MatchesAsReference) {
  const Rows a = SiftRows(400, 13);
  const Rows b = NoisyCopies(a, 14);
  const Rows bits_a = UniformRows(150, 1, 15);
  const Rows bits_b = UniformRows(150, 1, 16);
  std::size_t num_matches = 0;
  for (const double max_ratio : {0.6, 0.8, 0.95, 1.0, 1.5}) {
    for (const double max_distance : {0.2, 0.7, 1.5, 4.0}) {
      for (const bool cross_check : {false, true}) {
        for (const int max_num_matches : {32768, 100}) {
          DescriptorMatchingOptions options;
          options.max_ratio = max_ratio;
          options.max_distance = max_distance;
          options.cross_check = cross_check;
          options.max_num_matches = max_num_matches;
          DescriptorMatcher matcher(options);
          const std::vector<FeatureMatch> matches = matcher.Match(View(a), View(b));
          EXPECT_EQ(matches, ReferenceMatch(options, View(a), View(b)));
          num_matches += matches.size();
          // Equal products, which only pass a max_ratio above 1.
          EXPECT_EQ(matcher.Match(View(bits_a), View(bits_b)),
                    ReferenceMatch(options, View(bits_a), View(bits_b)));
          EXPECT_EQ(matcher.Match(View(bits_a), View(bits_a)),
                    ReferenceMatch(options, View(bits_a), View(bits_a)));
        }
      }
    }
  }
  EXPECT_GT(num_matches, 1000U);
}

TEST_P(MatchingTest, MatchesNearTheThresholds) {
  // Pairs of rows with one entry each to meet, at every product around the greatest distance.
  const DescriptorMatchingOptions options;
  DescriptorMatcher matcher(options);
  const double threshold = std::cos(options.max_distance) * 512 * 512;
  const int base = static_cast<int>(threshold) / (255 * 255);
  std::size_t num_matches = 0;
  for (int offset = -300; offset < 300; ++offset) {
    Rows a(kDescriptorDim, 0);
    Rows b(kDescriptorDim, 0);
    for (int d = 0; d < base; ++d)
      a[static_cast<std::size_t>(d)] = b[static_cast<std::size_t>(d)] = 255;
    int rest = static_cast<int>(threshold) + offset - base * 255 * 255;
    for (std::size_t d = 64; rest > 0; ++d) {
      const int part = std::min(rest, 255);
      a[d] = 1;
      b[d] = static_cast<std::uint8_t>(part);
      rest -= part;
      if (d == 127) break;
    }
    const auto matches = matcher.Match(View(a), View(b));
    ASSERT_EQ(matches, ReferenceMatch(options, View(a), View(b))) << offset;
    num_matches += matches.size();
  }
  EXPECT_GT(num_matches, 0U);
  EXPECT_LT(num_matches, 600U);
}

TEST_P(MatchingTest, ThresholdsThatAreMetExactly) {
  // Angles as the matcher computes them: whether one that is met exactly passes, decides one bit.
  const auto angle = [](std::int32_t product) {
    return std::acos(std::min(1.0F / (512.0F * 512.0F) * static_cast<float>(product), 1.0F));
  };
  const Rows a = SiftRows(60, 21);
  const Rows b = NoisyCopies(a, 22);
  for (std::size_t i = 0; i < View(a).num; ++i) {
    const ReferenceBest found = ReferenceBestOf(View(a), i, View(b));
    if (angle(found.best) == 0) continue;
    DescriptorMatchingOptions options;
    options.cross_check = false;
    options.max_distance = 4;
    options.max_ratio = angle(found.best) / angle(found.second);
    EXPECT_EQ(DescriptorMatcher(options).Match(View(a), View(b)),
              ReferenceMatch(options, View(a), View(b)));
    options.max_ratio = 2;
    options.max_distance = angle(found.best);
    const auto matches = DescriptorMatcher(options).Match(View(a), View(b));
    EXPECT_EQ(matches, ReferenceMatch(options, View(a), View(b)));
    EXPECT_EQ(std::count_if(matches.begin(), matches.end(),
                            [&](const FeatureMatch& match) { return match.feature1 == i; }),
              1);
  }
}

TEST(DescriptorMatcher, Options) {
  const auto check = [](double ratio, double distance, int num) {
    DescriptorMatchingOptions options;
    options.max_ratio = ratio;
    options.max_distance = distance;
    options.max_num_matches = num;
    options.Check();
  };
  check(0.8, 0.7, 1);
  EXPECT_THROW(check(0, 0.7, 1), OptionsError);
  EXPECT_THROW(check(std::nan(""), 0.7, 1), OptionsError);
  EXPECT_THROW(check(0.8, -1, 1), OptionsError);
  EXPECT_THROW(check(0.8, 0.7, 0), OptionsError);
}

// An image's features in these tests: as many rows of its id as the id says.
MatchingFeatures FeaturesOf(ImageId image) {
  MatchingFeatures features;
  features.descriptors.assign(image * kDescriptorDim, static_cast<std::uint8_t>(image));
  return features;
}

TEST(DescriptorCache, ReadsEachImageOnceIfThereIsRoom) {
  DescriptorCache cache(1 << 20, 2, [] { return FeaturesOf; });
  for (int round = 0; round < 3; ++round) {
    for (ImageId image = 1; image <= 20; ++image) {
      const auto handle = cache.Request(image);
      EXPECT_EQ(cache.Wait(handle).View().num, image);
      EXPECT_THAT(cache.Wait(handle).descriptors, Each(image));
    }
  }
  EXPECT_EQ(cache.NumReads(), 20U);
  EXPECT_EQ(DescriptorCachePeer::MaxBytesKept(cache), 20U * 21 / 2 * kDescriptorDim);
}

TEST(DescriptorCache, DropsWhatWasNotUsedForLongest) {
  // Room for the images 1, 2 and 3, or for 4 and 2.
  DescriptorCache cache(6 * kDescriptorDim, 1, [] { return FeaturesOf; });
  const auto use = [&](ImageId image) { cache.Wait(cache.Request(image)); };
  for (const ImageId image : {1, 2, 3}) use(image);
  use(2);
  use(1);
  EXPECT_EQ(cache.NumReads(), 3U);
  use(4);  // Drops 3 and 2.
  EXPECT_EQ(cache.NumReads(), 4U);
  use(1);
  EXPECT_EQ(cache.NumReads(), 4U);
  use(2);
  EXPECT_EQ(cache.NumReads(), 5U);
  EXPECT_LE(DescriptorCachePeer::MaxBytesKept(cache), 6U * kDescriptorDim);
}

TEST(DescriptorCache, WhatIsHeldStaysThoughTheCacheHasNoRoom) {
  DescriptorCache cache(0, 2, [] { return FeaturesOf; });
  std::vector<std::pair<ImageId, DescriptorCache::Handle>> handles;
  for (ImageId image = 1; image <= 50; ++image) handles.emplace_back(image, cache.Request(image));
  for (const auto& [image, handle] : handles) EXPECT_EQ(cache.Wait(handle).View().num, image);
  EXPECT_EQ(DescriptorCachePeer::MaxBytesKept(cache), 0U);
}

TEST(DescriptorCache, AnErrorIsThrownToWhoeverWaitsAndTriedAgain) {
  std::atomic<int> tries{0};
  DescriptorCache cache(1 << 20, 1, [&] {
    return [&](ImageId image) {
      if (image == 7 && ++tries == 1) throw std::runtime_error("unreadable");
      return FeaturesOf(image);
    };
  });
  const auto first = cache.Request(7);
  EXPECT_THROW(cache.Wait(first), std::runtime_error);
  EXPECT_EQ(cache.Wait(cache.Request(7)).View().num, 7U);
  EXPECT_EQ(cache.Wait(cache.Request(3)).View().num, 3U);
}

TEST(DescriptorCache, WithoutAThreadWhoeverWaitsReads) {
  DescriptorCache cache(1 << 20, 0, [] { return FeaturesOf; });
  std::vector<DescriptorCache::Handle> handles;
  for (ImageId image = 1; image <= 20; ++image) handles.push_back(cache.Request(image));
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&] {
      for (std::size_t i = handles.size(); i-- > 0;) {
        wrong += cache.Wait(handles[i]).View().num == i + 1 ? 0 : 1;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(cache.NumReads(), 20U);
}

TEST(DescriptorCache, AReaderThatCannotStart) {
  DescriptorCache cache(1 << 20, 1,
                        []() -> DescriptorCache::Reader { throw DatabaseError("gone"); });
  EXPECT_THROW(cache.Wait(cache.Request(1)), DatabaseError);
}

TEST(DescriptorCache, ManyThreads) {
  DescriptorCache cache(60 * kDescriptorDim, 3, [] { return FeaturesOf; });
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (std::uint64_t t = 0; t < 4; ++t) {
    threads.emplace_back([&cache, &wrong, t] {
      Random random({t});
      for (int i = 0; i < 2000; ++i) {
        const auto image = static_cast<ImageId>(1 + random.Index(30));
        const auto handle = cache.Request(image);
        if (cache.Wait(handle).View().num != image) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(DescriptorCachePeer::MaxBytesKept(cache), 60U * kDescriptorDim);
}

TEST(DescriptorCache, CanBeClosedWhileImagesAreOnTheirWay) {
  DescriptorCache cache(1 << 20, 1, [] { return FeaturesOf; });
  for (ImageId image = 1; image <= 100; ++image) cache.Request(image);
}

TEST(DescriptorCache, TheDefaultIsAShareOfTheMemory) {
  EXPECT_GT(DefaultCacheBytes(), std::size_t{10} << 20);
}

TEST(DescriptorCache, MemoryLimitsOfControlGroups) {
  const std::filesystem::path root =
      std::filesystem::path(::testing::TempDir()) / ("cgroup" + std::to_string(::getpid()));
  const auto write = [&](const std::string& path, const std::string& text) {
    std::filesystem::create_directories((root / path).parent_path());
    std::ofstream(root / path) << text << "\n";
  };
  const auto limit = [&](const std::string& groups) {
    write("groups", groups);
    return MemoryLimit(root / "groups", root);
  };
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  EXPECT_EQ(MemoryLimit(root / "none", root), kNone);
  write("job/step/memory.max", "max");
  EXPECT_EQ(limit("0::/job/step"), kNone);
  write("job/memory.max", "5000");
  EXPECT_EQ(limit("0::/job/step"), 5000U);
  EXPECT_EQ(limit("0::/"), kNone);
  write("job/step/memory.max", "4000");
  EXPECT_EQ(limit("1:name=systemd:/x\n0::/job/step"), 4000U);
  write("memory/batch/memory.limit_in_bytes", "3000");
  EXPECT_EQ(limit("9:memory:/batch"), 3000U);
  EXPECT_EQ(limit("9:cpu:/batch"), kNone);
  write("memory.max", "2000");
  EXPECT_EQ(limit("0::/job/step"), 2000U);
  std::filesystem::remove_all(root);
}

// Image reads of a cache with room for so many images, if the pairs come in this order.
std::size_t CountReads(const std::vector<ImagePair>& pairs, std::size_t room) {
  MatchingFeatures features;
  features.descriptors.assign(kDescriptorDim, 1);
  DescriptorCache cache(room * kDescriptorDim, 1,
                        [&] { return [&](ImageId) { return features; }; });
  for (const ImagePair& pair : pairs) {
    cache.Wait(cache.Request(pair.id1));
    cache.Wait(cache.Request(pair.id2));
  }
  return cache.NumReads();
}

TEST(PairOrder, ReusesImagesWhateverTheSizeOfTheCache) {
  std::vector<ImagePair> pairs;
  for (ImageId a = 1; a <= 128; ++a) {
    for (ImageId b = a + 1; b <= 128; ++b) pairs.emplace_back(a, b);
  }
  std::vector<ImagePair> sorted = pairs;
  SortForReuse(&sorted);
  EXPECT_TRUE(std::is_permutation(sorted.begin(), sorted.end(), pairs.begin()));
  // A square of n x n pairs needs 2 n reads.
  for (const std::size_t room : {8U, 16U, 32U, 64U}) {
    const double reads = static_cast<double>(CountReads(sorted, room));
    EXPECT_LT(reads / static_cast<double>(pairs.size()), 5.0 / static_cast<double>(room))
        << "room for " << room;
    EXPECT_LT(reads, 0.7 * static_cast<double>(CountReads(pairs, room)));
  }
}

TEST(PairOrder, AnyIds) {
  std::vector<ImagePair> pairs = {
      {2147483646, 3}, {1, 2147483645}, {1, 2}, {2147483646, 2147483645}};
  SortForReuse(&pairs);
  EXPECT_THAT(pairs, ElementsAre(ImagePair(1, 2), ImagePair(1, 2147483645),
                                 ImagePair(3, 2147483646), ImagePair(2147483645, 2147483646)));
}

}  // namespace
}  // namespace colmap_graphmatch
