#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"
#include "colmap_graphmatch/pipeline/pair_list.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class PairListTest : public ::testing::Test {
 protected:
  PairList Read(const std::string& text) {
    std::ofstream(path_) << text;
    return ReadPairList(path_, images_);
  }

  TestDirectory directory_;
  std::filesystem::path path_ = directory_.Path() / "pairs.txt";
  std::vector<ImageRecord> images_ = {{1, "a.jpg", 1},
                                      {2, "b.jpg", 1},
                                      {3, "my photo.jpg", 1},
                                      {4, "photo.jpg", 1},
                                      {5, "a.jpg my", 1}};
};

TEST_F(PairListTest, TwoNamesALine) {
  const PairList list = Read("# a comment\na.jpg b.jpg\n\nphoto.jpg a.jpg\r\nb.jpg\ta.jpg \n");
  EXPECT_THAT(list.pairs, ElementsAre(ImagePair(1, 2), ImagePair(1, 4), ImagePair(1, 2)));
  EXPECT_EQ(list.num_skipped, 0U);
}

TEST_F(PairListTest, WhatStandsBeforeAndAfter) {
  EXPECT_THAT(Read("  a.jpg b.jpg\n  # a comment\na.jpg b.jpg 0.83 x\na.jpg\tb.jpg\t0.5\n").pairs,
              ElementsAre(ImagePair(1, 2), ImagePair(1, 2), ImagePair(1, 2)));
}

TEST_F(PairListTest, NamesWithSpaces) {
  EXPECT_THAT(Read("my photo.jpg b.jpg\nb.jpg my photo.jpg\n").pairs,
              ElementsAre(ImagePair(2, 3), ImagePair(2, 3)));
}

TEST_F(PairListTest, LinesThatCanBeReadInTwoWays) {
  try {
    Read("a.jpg b.jpg\na.jpg my photo.jpg\n");
    FAIL();
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("Line 2"));
    EXPECT_THAT(error.what(), HasSubstr("\"a.jpg my photo.jpg\""));
  }
  EXPECT_THAT(Read("a.jpg\tmy photo.jpg").pairs, ElementsAre(ImagePair(1, 3)));
}

TEST_F(PairListTest, LinesThatNameNoPairAreCounted) {
  const PairList list = Read("a.jpg c.jpg\na.jpg\nb.jpg b.jpg\na.jpg b.jpg");
  EXPECT_THAT(list.pairs, ElementsAre(ImagePair(1, 2)));
  EXPECT_EQ(list.num_skipped, 3U);
  EXPECT_EQ(list.first_skipped, "a.jpg c.jpg");
  EXPECT_THROW(Read(""), FileError);
  EXPECT_THROW(Read("# nothing\n\n"), FileError);
  EXPECT_THAT(Read("\xEF\xBB\xBF"
                   "a.jpg b.jpg")
                  .pairs,
              ElementsAre(ImagePair(1, 2)));
  EXPECT_THROW(Read("a.jpg c.jpg"), FileError);
  images_[1].num_features = 0;
  EXPECT_THROW(Read("a.jpg b.jpg"), FileError);
}

// As long as the longest two names, and far longer: the time must not grow with its square.
TEST_F(PairListTest, LongLines) {
  EXPECT_THAT(Read("my photo.jpg photo.jpg\nphoto.jpg my photo.jpg x\n").pairs,
              ElementsAre(ImagePair(3, 4), ImagePair(3, 4)));
  images_.push_back({6, "b.jpg my photo.jpg", 1});
  EXPECT_THAT(Read("a.jpg\tb.jpg my photo.jpg\n").pairs, ElementsAre(ImagePair(1, 6)));
  std::string words = "a.jpg b.jpg";
  for (int i = 0; i < 8000000; ++i) words += " a";
  EXPECT_THAT(Read(words).pairs, ElementsAre(ImagePair(1, 2)));
}

TEST_F(PairListTest, AFileThatIsNotThere) {
  EXPECT_THROW(ReadPairList("/nowhere/pairs.txt", images_), FileError);
  EXPECT_THROW(ReadPairList(directory_.Path(), images_), FileError);
}

TEST(PipelineOptions, AListAndAnotherStrategyContradictEachOther) {
  PipelineOptions options;
  options.match_list_path = "pairs.txt";
  options.Check();
  options.strategy = PipelineOptions::Strategy::kExhaustive;
  EXPECT_THROW(options.Check(), OptionsError);
}

}  // namespace
}  // namespace colmap_graphmatch
