#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <mutex>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <unordered_set>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/largest_scales.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr ImageId kLargestId = 2147483646;

TEST(ImagePairTest, KeepsTheSmallerIdFirst) {
  const ImagePair pair(7, 3);
  EXPECT_EQ(pair.id1, 3u);
  EXPECT_EQ(pair.id2, 7u);
  EXPECT_EQ(pair, ImagePair(3, 7));
  EXPECT_NE(pair, ImagePair(3, 8));
  EXPECT_NE(pair, ImagePair(2, 7));
}

TEST(ImagePairTest, IsOrderedByFirstThenSecondId) {
  EXPECT_LT(ImagePair(1, 9), ImagePair(2, 3));
  EXPECT_LT(ImagePair(2, 3), ImagePair(2, 4));
  EXPECT_FALSE(ImagePair(2, 3) < ImagePair(3, 2));
}

TEST(PairCodecTest, EncodesAsColmapDoes) {
  // 2147483647 * id1 + id2, computed by hand.
  EXPECT_EQ(EncodePair(ImagePair(1, 2)), 2147483649ull);
  EXPECT_EQ(EncodePair(ImagePair(3, 10)), 6442450951ull);
  EXPECT_EQ(EncodePair(ImagePair(kLargestId - 1, kLargestId)), 4611686011984936961ull);
}

TEST(PairCodecTest, DecodesWhatItEncodedWhateverTheOrder) {
  const std::vector<ImageId> ids = {1,     2,          3,          1000,           65535,     65536,
                                    70001, 1073741823, 1073741824, kLargestId - 1, kLargestId};
  std::set<PairId> pair_ids;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    for (std::size_t j = i + 1; j < ids.size(); ++j) {
      const PairId pair_id = EncodePair(ImagePair(ids[i], ids[j]));
      EXPECT_EQ(pair_id, EncodePair(ImagePair(ids[j], ids[i])));
      const ImagePair pair = DecodePair(pair_id);
      EXPECT_EQ(pair.id1, ids[i]);
      EXPECT_EQ(pair.id2, ids[j]);
      EXPECT_TRUE(pair_ids.insert(pair_id).second) << ids[i] << " " << ids[j];
    }
  }
}

TEST(PairCodecTest, PairsCanBeKeptInHashTables) {
  std::unordered_set<ImagePair> pairs;
  for (ImageId a = 1; a <= 30; ++a) {
    for (ImageId b = 1; b <= 30; ++b) {
      if (a != b) pairs.insert(ImagePair(a, b));
    }
  }
  EXPECT_EQ(pairs.size(), 30u * 29u / 2u);
  EXPECT_EQ(pairs.count(ImagePair(30, 1)), 1u);
  EXPECT_EQ(pairs.count(ImagePair(31, 1)), 0u);
}

std::vector<std::uint64_t> FirstNumbers(Random random, int count) {
  std::vector<std::uint64_t> numbers;
  for (int i = 0; i < count; ++i) numbers.push_back(random.Next());
  return numbers;
}

TEST(RandomTest, IsSplitMix64) {
  // The published sequence of the seed 0.
  Random random(std::initializer_list<std::uint64_t>{});
  EXPECT_EQ(random.Next(), 0xE220A8397B1DCDAFull);
  EXPECT_EQ(random.Next(), 0x6E789E6AA1B965F4ull);
  EXPECT_EQ(random.Next(), 0x06C45D188009454Full);
}

TEST(RandomTest, SameKeysGiveTheSameNumbers) {
  EXPECT_EQ(FirstNumbers(Random({5, 2, 17}), 100), FirstNumbers(Random({5, 2, 17}), 100));
}

TEST(RandomTest, DifferentKeysGiveDifferentNumbers) {
  const std::vector<std::vector<std::uint64_t>> sequences = {
      FirstNumbers(Random({0}), 100),      FirstNumbers(Random({1}), 100),
      FirstNumbers(Random({0, 0}), 100),   FirstNumbers(Random({0, 1}), 100),
      FirstNumbers(Random({1, 0}), 100),   FirstNumbers(Random({1, 1}), 100),
      FirstNumbers(Random({1, 2}), 100),   FirstNumbers(Random({2, 1}), 100),
      FirstNumbers(Random({1, 2, 0}), 100)};
  std::set<std::uint64_t> numbers;
  for (const auto& sequence : sequences) numbers.insert(sequence.begin(), sequence.end());
  EXPECT_EQ(numbers.size(), sequences.size() * 100);
}

TEST(RandomTest, NumbersOfAdjacentKeysAreNotRelated) {
  // The first numbers of consecutive images must be as uniform as those of one image.
  constexpr int kNumImages = 100000;
  std::vector<int> counts(10);
  for (std::uint64_t image_id = 1; image_id <= kNumImages; ++image_id) {
    ++counts[Random({0, 3, image_id}).Index(counts.size())];
  }
  double chi_square = 0;
  for (const int count : counts) {
    const double expected = kNumImages / 10.0;
    chi_square += (count - expected) * (count - expected) / expected;
  }
  EXPECT_LT(chi_square, 40);
}

TEST(RandomTest, UniformIsInTheHalfOpenUnitInterval) {
  Random random({1});
  double smallest = 1;
  double largest = 0;
  double sum = 0;
  double sum_of_squares = 0;
  constexpr int kNumDraws = 100000;
  for (int i = 0; i < kNumDraws; ++i) {
    const double number = random.Uniform();
    ASSERT_GE(number, 0);
    ASSERT_LT(number, 1);
    smallest = std::min(smallest, number);
    largest = std::max(largest, number);
    sum += number;
    sum_of_squares += number * number;
  }
  EXPECT_LT(smallest, 1e-3);
  EXPECT_GT(largest, 1 - 1e-3);
  EXPECT_NEAR(sum / kNumDraws, 1.0 / 2, 0.005);
  EXPECT_NEAR(sum_of_squares / kNumDraws, 1.0 / 3, 0.005);
}

TEST(RandomTest, IndexIsUniform) {
  Random random({2});
  for (const std::size_t n : {2u, 3u, 7u, 100u}) {
    constexpr int kNumDraws = 200000;
    std::vector<int> counts(n);
    for (int i = 0; i < kNumDraws; ++i) {
      const std::uint64_t index = random.Index(n);
      ASSERT_LT(index, n);
      ++counts[index];
    }
    const double expected = kNumDraws / static_cast<double>(n);
    double chi_square = 0;
    for (const int count : counts) {
      chi_square += (count - expected) * (count - expected) / expected;
    }
    // Mean n - 1, standard deviation sqrt(2 (n - 1)).
    const auto degrees = static_cast<double>(n - 1);
    EXPECT_LT(chi_square, degrees + 6 * std::sqrt(2 * degrees) + 6) << n;
  }
}

TEST(RandomTest, IndexStaysInRangeForTheSmallestAndLargestRanges) {
  Random random({3});
  constexpr std::uint64_t kLargest = std::numeric_limits<std::uint64_t>::max();
  for (int i = 0; i < 10000; ++i) {
    ASSERT_EQ(random.Index(1), 0u);
    ASSERT_LT(random.Index((1ull << 53) + 1), (1ull << 53) + 1);
    ASSERT_LT(random.Index(kLargest), kLargest);
  }
}

TEST(ThreadPoolTest, CallsEveryIndexExactlyOnce) {
  for (int num_threads = 1; num_threads <= 16; ++num_threads) {
    ThreadPool threads(num_threads);
    EXPECT_EQ(threads.NumThreads(), num_threads);
    for (const std::size_t count : {0u, 1u, 2u, 15u, 1000u}) {
      std::vector<std::atomic<int>> calls(count);
      threads.ParallelFor(count, [&](std::size_t i) { ++calls.at(i); });
      std::vector<int> nums(calls.begin(), calls.end());
      EXPECT_EQ(nums.size(), count);
      EXPECT_THAT(nums, Each(1)) << num_threads << " threads, " << count << " calls";
    }
  }
}

TEST(ThreadPoolTest, ReturnsOnlyWhenAllCallsAreDone) {
  ThreadPool threads(4);
  std::atomic<int> num_done{0};
  threads.ParallelFor(8, [&](std::size_t) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ++num_done;
  });
  EXPECT_EQ(num_done, 8);
}

// Calls that only return once as many of them are under way at the same time as were expected.
class Rendezvous {
 public:
  explicit Rendezvous(int num_expected) : num_expected_(num_expected) {}

  // False if the others did not come.
  bool Wait() {
    std::unique_lock<std::mutex> lock(mutex_);
    ++num_arrived_;
    arrived_.notify_all();
    return arrived_.wait_for(lock, std::chrono::seconds(20),
                             [&] { return num_arrived_ >= num_expected_; });
  }

 private:
  const int num_expected_;
  int num_arrived_ = 0;
  std::mutex mutex_;
  std::condition_variable arrived_;
};

TEST(ThreadPoolTest, AllThreadsRunAtTheSameTimeAndTheCallingOneIsOfThem) {
  ThreadPool threads(4);
  Rendezvous rendezvous(4);
  std::mutex mutex;
  std::set<std::thread::id> ids;
  std::atomic<int> num_met{0};
  threads.ParallelFor(4, [&](std::size_t) {
    if (rendezvous.Wait()) ++num_met;
    const std::lock_guard<std::mutex> lock(mutex);
    ids.insert(std::this_thread::get_id());
  });
  EXPECT_EQ(num_met, 4);
  EXPECT_EQ(ids.size(), 4u);
  EXPECT_EQ(ids.count(std::this_thread::get_id()), 1u);
}

TEST(ThreadPoolTest, OneThreadIsTheCallingOneAndGoesInOrder) {
  ThreadPool threads(1);
  const std::thread::id caller = std::this_thread::get_id();
  std::vector<std::size_t> order;
  threads.ParallelFor(5, [&](std::size_t i) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    order.push_back(i);
  });
  EXPECT_THAT(order, ElementsAre(0, 1, 2, 3, 4));
}

TEST(ThreadPoolTest, RethrowsAnExceptionAndStaysUsable) {
  for (const int num_threads : {1, 2, 5, 16}) {
    ThreadPool threads(num_threads);
    for (int round = 0; round < 20; ++round) {
      try {
        threads.ParallelFor(1000, [](std::size_t i) {
          if (i == 123) throw std::out_of_range("The call 123 failed.");
        });
        ADD_FAILURE() << "Nothing was thrown by " << num_threads << " threads.";
      } catch (const std::out_of_range& error) {
        EXPECT_STREQ(error.what(), "The call 123 failed.");
      }
      std::atomic<int> num_calls{0};
      threads.ParallelFor(100, [&](std::size_t) { ++num_calls; });
      EXPECT_EQ(num_calls, 100);
    }
  }
}

TEST(ThreadPoolTest, RethrowsOneOfManyExceptions) {
  ThreadPool threads(8);
  for (int round = 0; round < 20; ++round) {
    EXPECT_THROW(threads.ParallelFor(100, [](std::size_t) { throw std::runtime_error("failed"); }),
                 std::runtime_error);
  }
}

TEST(ThreadPoolTest, RethrowsWhatAnotherThreadThrew) {
  ThreadPool threads(2);
  Rendezvous rendezvous(2);
  const std::thread::id caller = std::this_thread::get_id();
  EXPECT_THROW(threads.ParallelFor(2,
                                   [&](std::size_t) {
                                     rendezvous.Wait();
                                     if (std::this_thread::get_id() != caller) {
                                       throw std::out_of_range("failed");
                                     }
                                   }),
               std::out_of_range);
}

TEST(ThreadPoolTest, SkipsTheRemainingCallsAfterAnException) {
  ThreadPool threads(1);
  std::vector<std::size_t> order;
  EXPECT_THROW(threads.ParallelFor(1000,
                                   [&](std::size_t i) {
                                     order.push_back(i);
                                     if (i == 2) throw std::runtime_error("failed");
                                   }),
               std::runtime_error);
  EXPECT_THAT(order, ElementsAre(0, 1, 2));
}

TEST(ThreadPoolTest, OtherThreadsSkipTheRemainingCallsAfterAnException) {
  constexpr int kCount = 1000;
  ThreadPool threads(4);
  std::atomic<bool> thrown{false};
  std::atomic<int> num_calls{0};
  EXPECT_THROW(threads.ParallelFor(kCount,
                                   [&](std::size_t i) {
                                     ++num_calls;
                                     if (i == 0) {
                                       thrown = true;
                                       throw std::runtime_error("failed");
                                     }
                                     while (!thrown) std::this_thread::yield();
                                     std::this_thread::sleep_for(std::chrono::milliseconds(5));
                                   }),
               std::runtime_error);
  EXPECT_LT(num_calls, kCount);
}

TEST(ThreadPoolTest, MinusOneMeansAllCores) {
  const int num_cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  EXPECT_EQ(EffectiveNumThreads(-1), num_cores);
  ThreadPool threads(-1);
  EXPECT_EQ(threads.NumThreads(), num_cores);
  std::atomic<int> num_calls{0};
  threads.ParallelFor(100, [&](std::size_t) { ++num_calls; });
  EXPECT_EQ(num_calls, 100);
}

TEST(ThreadPoolTest, PositiveNumbersOfThreadsAreTakenAsTheyAre) {
  EXPECT_EQ(EffectiveNumThreads(1), 1);
  EXPECT_EQ(EffectiveNumThreads(37), 37);
}

TEST(ThreadPoolTest, OtherNumbersOfThreadsAreRefused) {
  for (const int num_threads : {0, -2, std::numeric_limits<int>::min()}) {
    EXPECT_THROW(EffectiveNumThreads(num_threads), OptionsError) << num_threads;
    EXPECT_THROW(ThreadPool threads(num_threads), OptionsError) << num_threads;
  }
  try {
    EffectiveNumThreads(-2);
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("-2"));
  }
}

TEST(StopRequestTest, RisesStepByStepToItsHighestLevel) {
  StopRequest stop;
  EXPECT_FALSE(stop.Requested());
  EXPECT_FALSE(stop.Abandon());
  EXPECT_NO_THROW(stop.ThrowIfRequested());
  stop.Raise();
  EXPECT_TRUE(stop.Requested());
  EXPECT_FALSE(stop.Abandon());
  EXPECT_THROW(stop.ThrowIfRequested(), StoppedError);
  for (int i = 0; i < 3; ++i) {
    stop.Raise();
    EXPECT_TRUE(stop.Requested());
    EXPECT_TRUE(stop.Abandon());
    EXPECT_THROW(stop.ThrowIfRequested(), StoppedError);
  }
}

TEST(StopRequestTest, NoRaiseIsLostWhenTwoThreadsRaise) {
  std::vector<StopRequest> stops(100000);
  std::atomic<int> num_started{0};
  const auto raise_all = [&] {
    ++num_started;
    while (num_started < 2) std::this_thread::yield();
    for (StopRequest& stop : stops) stop.Raise();
  };
  std::thread other(raise_all);
  raise_all();
  other.join();
  for (const StopRequest& stop : stops) ASSERT_TRUE(stop.Abandon());
}

TEST(SelectLargestScalesTest, ReturnsTheRowsOfTheLargestScalesAscending) {
  EXPECT_THAT(SelectLargestScales({5, 1, 9, 3, 7, 2}, 3), ElementsAre(0, 2, 4));
  EXPECT_THAT(SelectLargestScales({1, 2, 3, 4}, 1), ElementsAre(3));
}

TEST(SelectLargestScalesTest, ReturnsAllRowsIfThereAreNoMore) {
  EXPECT_THAT(SelectLargestScales({3, 1, 2}, 3), ElementsAre(0, 1, 2));
  EXPECT_THAT(SelectLargestScales({3, 1, 2}, 100), ElementsAre(0, 1, 2));
  EXPECT_THAT(SelectLargestScales({}, 3), IsEmpty());
  EXPECT_THAT(SelectLargestScales({3, 1, 2}, 0), IsEmpty());
}

TEST(SelectLargestScalesTest, PrefersTheFirstOfEqualScales) {
  EXPECT_THAT(SelectLargestScales({2, 5, 2, 2, 7, 2}, 4), ElementsAre(0, 1, 2, 4));
  const std::vector<std::size_t> rows = SelectLargestScales(std::vector<float>(1000, 3), 100);
  std::vector<std::size_t> expected(100);
  std::iota(expected.begin(), expected.end(), std::size_t{0});
  EXPECT_EQ(rows, expected);
}

TEST(SelectLargestScalesTest, TakesNaNAsZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(SelectLargestScales({nan, 1, nan, 2, nan, 0.5F}, 3), ElementsAre(1, 3, 5));
  EXPECT_THAT(SelectLargestScales({1, 0, nan, 0, nan}, 3), ElementsAre(0, 1, 2));
  EXPECT_THAT(SelectLargestScales({nan, 0, 1}, 2), ElementsAre(0, 2));
  EXPECT_THAT(SelectLargestScales({nan, 0, nan, nan, 0, 0}, 3), ElementsAre(0, 1, 2));
}

TEST(SelectLargestScalesTest, AgreesWithSortingForManyScales) {
  Random random({44});
  std::vector<float> scales(2000);
  for (float& scale : scales) scale = static_cast<float>(random.Index(50));
  std::vector<std::size_t> expected(scales.size());
  std::iota(expected.begin(), expected.end(), std::size_t{0});
  std::stable_sort(expected.begin(), expected.end(),
                   [&](std::size_t a, std::size_t b) { return scales[a] > scales[b]; });
  expected.resize(777);
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(SelectLargestScales(scales, 777), expected);
}

}  // namespace
}  // namespace colmap_graphmatch
