#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <set>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/pipeline/budgeted_verifier.h"
#include "colmap_graphmatch/pipeline/details_recorder.h"
#include "support/recording_verifier.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

// Pairs of image 1 with the others from 2 on.
std::vector<ImagePair> Pairs(ImageId num) {
  std::vector<ImagePair> pairs;
  for (ImageId id = 2; id < 2 + num; ++id) pairs.emplace_back(1, id);
  return pairs;
}

// The later images are nearer.
double LaterIsNearer(const ImagePair& pair) { return -static_cast<double>(pair.id2); }

class BudgetTest : public ::testing::Test {
 protected:
  BudgetedVerifier Make(const TestBudget& budget, BudgetedVerifier::Order order) {
    return BudgetedVerifier(
        inner_, budget, 1, [this] { return seconds_; }, std::move(order));
  }

  bool Verify(BudgetedVerifier* verifier, const std::vector<ImagePair>& pairs) {
    return verifier->Verify(pairs, [this](const VerifiedPair& verified) {
      seconds_ += 1;
      answered_.push_back(verified.pair);
    });
  }

  RecordingVerifier inner_{{ImagePair(1, 3)}};
  std::vector<ImagePair> answered_;
  double seconds_ = 0;
};

TEST_F(BudgetTest, WithoutLimitsEverythingIsTested) {
  BudgetedVerifier verifier = Make({}, LaterIsNearer);
  EXPECT_TRUE(Verify(&verifier, Pairs(100)));
  EXPECT_EQ(inner_.tested.size(), 100U);
  EXPECT_THAT(inner_.batches, SizeIs(1));
  EXPECT_EQ(verifier.Reached(), BudgetedVerifier::Limit::kNone);
}

TEST_F(BudgetTest, ABatchThatIsNotCutIsPassedOnWithWhatIsKnown) {
  inner_.known = {ImagePair(1, 3), ImagePair(1, 50)};
  BudgetedVerifier unlimited = Make({}, LaterIsNearer);
  EXPECT_TRUE(Verify(&unlimited, Pairs(100)));
  EXPECT_THAT(inner_.batches, ElementsAre(Pairs(100)));
  TestBudget budget;
  budget.max_pairs = 98;
  BudgetedVerifier just_enough = Make(budget, LaterIsNearer);
  EXPECT_TRUE(Verify(&just_enough, Pairs(100)));
  EXPECT_THAT(inner_.batches.back(), ElementsAreArray(Pairs(100)));
  EXPECT_FALSE(Verify(&just_enough, {ImagePair(7, 8)}));
}

TEST_F(BudgetTest, TheMostPromisingPairsOfABatchThatIsTooLarge) {
  TestBudget budget;
  budget.max_pairs = 5;
  BudgetedVerifier verifier = Make(budget, LaterIsNearer);
  EXPECT_TRUE(Verify(&verifier, {ImagePair(1, 2), ImagePair(1, 3)}));
  EXPECT_FALSE(Verify(&verifier, {ImagePair(1, 4), ImagePair(1, 5), ImagePair(1, 6),
                                  ImagePair(1, 7), ImagePair(1, 8)}));
  EXPECT_EQ(verifier.Reached(), BudgetedVerifier::Limit::kMaxPairs);
  EXPECT_THAT(inner_.batches.back(),
              ElementsAre(ImagePair(1, 6), ImagePair(1, 7), ImagePair(1, 8)));
}

TEST_F(BudgetTest, WhatIsUsedUpToTheLastPairEndsWithTheNext) {
  TestBudget budget;
  budget.max_pairs = 3;
  inner_.known = {ImagePair(1, 9)};
  BudgetedVerifier verifier = Make(budget, nullptr);
  EXPECT_TRUE(Verify(&verifier, Pairs(3)));
  EXPECT_EQ(verifier.Reached(), BudgetedVerifier::Limit::kNone);
  // Known pairs cost nothing.
  EXPECT_TRUE(Verify(&verifier, {ImagePair(1, 9)}));
  EXPECT_FALSE(Verify(&verifier, {ImagePair(1, 9), ImagePair(1, 10)}));
  EXPECT_EQ(verifier.Reached(), BudgetedVerifier::Limit::kMaxPairs);
  EXPECT_EQ(inner_.tested.size(), 3U);
  EXPECT_THAT(answered_, SizeIs(5));
}

TEST_F(BudgetTest, StopsInTime) {
  TestBudget budget;
  budget.max_minutes = 12;  // 720 pairs of a second each.
  BudgetedVerifier verifier = Make(budget, LaterIsNearer);
  EXPECT_FALSE(Verify(&verifier, Pairs(1000)));
  EXPECT_EQ(verifier.Reached(), BudgetedVerifier::Limit::kMaxMinutes);
  EXPECT_LE(seconds_, 720);
  EXPECT_GE(seconds_, 720 - 64);
  // The nearest first, and in chunks that get smaller.
  ImageId smallest = std::numeric_limits<ImageId>::max();
  for (const ImagePair& pair : inner_.tested) smallest = std::min(smallest, pair.id2);
  EXPECT_EQ(smallest, 1001 - inner_.tested.size() + 1);
  EXPECT_EQ(inner_.batches[0].size(), 64U);
  EXPECT_EQ(inner_.batches[1].size(), 164U);
  EXPECT_EQ(inner_.batches.back().size(), 64U);
}

TEST_F(BudgetTest, NothingIsTestedWhenTimeIsOverBefore) {
  TestBudget budget;
  budget.max_minutes = 1;
  seconds_ = 61;
  BudgetedVerifier verifier = Make(budget, nullptr);
  EXPECT_FALSE(Verify(&verifier, Pairs(10)));
  EXPECT_THAT(inner_.tested, IsEmpty());
}

TEST_F(BudgetTest, AStopOfTheVerifierIsNoLimit) {
  TestBudget budget;
  budget.max_pairs = 100;
  budget.max_minutes = 100;
  inner_.stop_after = 4;
  BudgetedVerifier verifier = Make(budget, LaterIsNearer);
  EXPECT_FALSE(Verify(&verifier, Pairs(50)));
  EXPECT_EQ(verifier.Reached(), BudgetedVerifier::Limit::kNone);
}

TEST_F(BudgetTest, ANegativeTimeIsAnError) {
  TestBudget budget;
  budget.max_minutes = -1;
  EXPECT_THROW(budget.Check(), OptionsError);
}

LoopProgress Progress(LoopStage stage, int iteration, std::size_t tested, std::size_t edges) {
  LoopProgress progress;
  progress.stage = stage;
  progress.iteration = iteration;
  progress.all.num_tested = tested;
  progress.all.num_edges = edges;
  progress.last = {ImagePair(1, static_cast<ImageId>(tested + 1)), PairOutcome::kEdge, 20};
  return progress;
}

TEST(DetailsRecorder, ALongCurveKeepsItsEndsAndThoseOfItsBatches) {
  DetailsRecorder record;
  constexpr std::size_t kNum = 100000;
  for (std::size_t i = 1; i <= kNum; ++i) {
    const bool samples = i <= 3333;
    record.Add(Progress(samples ? LoopStage::kSampling : LoopStage::kPropagation,
                        i <= 77777 ? 0 : 1, i, i / 2),
               static_cast<double>(i));
  }
  const std::vector<DiscoveryPoint> points = record.Discovery();
  EXPECT_LE(points.size(), DetailsRecorder::kMaxPoints + 1);
  EXPECT_GE(points.size(), DetailsRecorder::kMaxPoints / 3);
  std::set<std::size_t> tests;
  for (std::size_t i = 0; i < points.size(); ++i) {
    tests.insert(points[i].num_tested);
    EXPECT_TRUE(i == 0 || points[i].num_tested > points[i - 1].num_tested);
    EXPECT_EQ(points[i].num_edges, points[i].num_tested / 2);
  }
  for (const std::size_t wanted : {std::size_t{1}, std::size_t{3333}, std::size_t{77777}, kNum}) {
    EXPECT_EQ(tests.count(wanted), 1U) << wanted;
  }
  EXPECT_THAT(record.Tested(), SizeIs(kNum));
}

TEST(DetailsRecorder, ManySmallBatches) {
  DetailsRecorder record;
  for (std::size_t i = 1; i <= 300000; ++i) {
    record.Add(Progress(LoopStage::kPropagation, static_cast<int>(i), i, 0), 1);
  }
  EXPECT_LE(record.Discovery().size(), DetailsRecorder::kMaxPoints + 1);
  EXPECT_GE(record.Discovery().size(), DetailsRecorder::kMaxPoints / 4);
  EXPECT_EQ(record.Discovery().back().num_tested, 300000U);
}

TEST(DetailsRecorder, KnownPairsOfImagesThatAreGoneAreLeftOut) {
  DetailsRecorder record;
  LoopProgress progress = Progress(LoopStage::kSampling, 0, 1, 1);
  record.Add(progress, 1);
  progress.last = {ImagePair(1, 3), PairOutcome::kNoEdge, 0};
  progress.last.is_known = true;
  record.Add(progress, 2);
  record.AddKnown(
      {{ImagePair(1, 3), PairOutcome::kNoEdge, 0}, {ImagePair(1, 8), PairOutcome::kEdge, 50}},
      {{1, "a", 1}, {2, "b", 1}, {3, "c", 1}});
  ASSERT_THAT(record.Tested(), SizeIs(2));
  EXPECT_EQ(record.Tested()[0].pair, ImagePair(1, 2));
  EXPECT_EQ(record.Tested()[1].pair, ImagePair(1, 3));
  EXPECT_THAT(record.Discovery(), SizeIs(1));
}

TEST(ImagesWithoutEdge, HaveTheirNearestTestedImages) {
  const std::vector<ImageRecord> images = {
      {1, "a", 9}, {2, "b", 9}, {4, "c", 9}, {7, "d", 9}, {9, "none", 0}};
  const std::vector<VerifiedPair> tested = {{ImagePair(1, 2), PairOutcome::kEdge, 40},
                                            {ImagePair(1, 4), PairOutcome::kNoEdge, 3},
                                            {ImagePair(1, 7), PairOutcome::kFailed, 0},
                                            {ImagePair(2, 4), PairOutcome::kNoEdge, 12},
                                            {ImagePair(4, 7), PairOutcome::kNoEdge, 0}};
  // On a line: images 1, 2, 4, 7 at 0, 90, 60 and 45 degrees.
  const std::vector<float> vectors = {1, 0, 0, 1, 0.5F, 0.8660254F, 0.70710678F, 0.70710678F};
  ThreadPool threads(1);
  const VectorRanking ranking({}, 4, 2, vectors, threads);
  const std::vector<ImageWithoutEdge> ranked =
      FindImagesWithoutEdge(images, tested, &ranking, {1, 2, 4, 7}, 2);
  ASSERT_THAT(ranked, SizeIs(3));
  EXPECT_EQ(ranked[0].image, 4U);
  ASSERT_THAT(ranked[0].candidates, SizeIs(2));
  EXPECT_EQ(ranked[0].candidates[0].image, 7U);
  EXPECT_EQ(ranked[0].candidates[1].image, 2U);
  EXPECT_EQ(ranked[0].candidates[1].num_inliers, 12U);
  EXPECT_NEAR(ranked[0].candidates[1].distance, 2 - 2 * 0.8660254, 1e-5);
  EXPECT_EQ(ranked[1].image, 7U);
  EXPECT_THAT(ranked[1].candidates, SizeIs(1));
  EXPECT_EQ(ranked[2].image, 9U);
  EXPECT_THAT(ranked[2].candidates, IsEmpty());

  // Without a ranking those with the most inliers come first.
  const std::vector<ImageWithoutEdge> listed =
      FindImagesWithoutEdge(images, tested, nullptr, {}, 5);
  ASSERT_THAT(listed[0].candidates, SizeIs(3));
  EXPECT_EQ(listed[0].candidates[0].image, 2U);
  EXPECT_EQ(listed[0].candidates[0].distance, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace colmap_graphmatch
