#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/verification/batch_verifier.h"
#include "colmap_graphmatch/verification/chosen_verifier.h"
#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/colmap_verifier.h"
#include "colmap_graphmatch/verification/fault_isolation.h"
#include "colmap_graphmatch/verification/plan.h"
#include "colmap_graphmatch/verification/shard_runner.h"
#include "colmap_graphmatch/verification/subprocess.h"
#include "colmap_graphmatch/verification/work_directory.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

bool Never() { return false; }

// The verifier on a small database with the test double of COLMAP in place of COLMAP.
class VerifierTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* name :
         {"FAKE_COLMAP_VERSION", "FAKE_COLMAP_SCHEMA", "FAKE_COLMAP_GROUP", "FAKE_COLMAP_FAULT",
          "FAKE_COLMAP_FAULT_PAIR", "FAKE_COLMAP_FAULT_IMAGE", "FAKE_COLMAP_FAULT_TIMES",
          "FAKE_COLMAP_DELAY_MS"}) {
      ::unsetenv(name);
    }
    Set("FAKE_COLMAP_LOG", (directory_.Path() / "log.txt").string());
    database_path_ = directory_.Path() / "data base.db";
    WriteSyntheticDatabase(database_path_, Schema::kColmap38, MakePlaces(5, 5, 30, 1));
    // These images match as the test double says, not as their descriptors do.
    options_.matcher = VerificationOptions::Matcher::kColmap;
    options_.verifier = VerificationOptions::Verifier::kColmap;
    options_.lock_timeout = 5;
  }

  static void Set(const std::string& name, const std::string& value) {
    ::setenv(name.c_str(), value.c_str(), 1);
  }

  // Verifies the pairs; false if the verifier left some out.
  bool Verify(const std::vector<ImagePair>& pairs) {
    Database database(database_path_, sqlite::Access::kReadWrite, 5);
    const WorkDirectory work(directory_.Path());
    const ColmapInstallation colmap = DetectColmap(FAKE_COLMAP_PATH, work.Path(), stop_);
    const std::vector<ImageRecord> images = database.ReadImages();
    const auto warn = [this](const std::string& warning) { warnings_.push_back(warning); };
    const VerificationPlan plan = PlanVerification(options_, num_threads_, colmap);
    ChosenVerifier geometry(options_, plan, colmap, database, images, work.Path(), stop_, warn);
    BatchVerifier verifier(options_, plan, geometry.Get(), database, images, stop_, warn);
    const bool complete = verifier.Verify(pairs, [&](const VerifiedPair& pair) {
      EXPECT_TRUE(outcomes_.emplace(pair.pair, pair.outcome).second);
      inliers_[pair.pair] = verifier.Inliers(pair.pair);
    });
    statistics_ = verifier.Statistics();
    fits_ = geometry.Fits();
    matched_here_ = plan.matches_here;
    EXPECT_THAT(ShardDirectories(work.Path()), IsEmpty());
    return complete;
  }

  static std::vector<std::string> ShardDirectories(const std::filesystem::path& path) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path)) {
      if (entry.is_directory()) names.push_back(entry.path().string());
    }
    return names;
  }

  std::map<ImagePair, FeatureMatches> inliers_;  // Of what was reported last.

  std::set<ImagePair> InDatabase() const {
    Database database(database_path_, sqlite::Access::kRead, 5);
    std::set<ImagePair> pairs;
    for (const TestedPair& tested : database.ReadTestedPairs()) pairs.insert(tested.pair);
    return pairs;
  }

  std::vector<std::string> Log() const {
    std::ifstream file(directory_.Path() / "log.txt");
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }

  std::size_t CountInLog(const std::string& beginning) const {
    std::size_t count = 0;
    for (const std::string& line : Log()) count += line.rfind(beginning, 0) == 0 ? 1U : 0U;
    return count;
  }

  TestDirectory directory_;
  std::filesystem::path database_path_;
  VerificationOptions options_;
  int num_threads_ = 2;
  StopRequest stop_;
  std::map<ImagePair, PairOutcome> outcomes_;
  MatchingStatistics statistics_;
  FitStatistics fits_;
  bool matched_here_ = false;
  std::vector<std::string> warnings_;
};

std::vector<ImagePair> AllPairs(ImageId num_images) {
  std::vector<ImagePair> pairs;
  for (ImageId a = 1; a <= num_images; ++a) {
    for (ImageId b = a + 1; b <= num_images; ++b) pairs.emplace_back(a, b);
  }
  return pairs;
}

// What the test double calls an edge.
bool IsFakeEdge(const ImagePair& pair) { return pair.id1 / 10 == pair.id2 / 10; }

TEST_F(VerifierTest, VerifiesEveryPairAndWritesItToTheDatabase) {
  const std::vector<ImagePair> pairs = AllPairs(25);
  EXPECT_TRUE(Verify(pairs));
  ASSERT_THAT(outcomes_, SizeIs(300));
  for (const auto& [pair, outcome] : outcomes_) {
    EXPECT_EQ(outcome, IsFakeEdge(pair) ? PairOutcome::kEdge : PairOutcome::kNoEdge);
  }
  EXPECT_EQ(InDatabase(), std::set<ImagePair>(pairs.begin(), pairs.end()));
  EXPECT_EQ(CountInLog("pair"), 300U);
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(VerifierTest, InliersAreReportedAndThoseOfKnownPairsRead) {
  EXPECT_TRUE(Verify(AllPairs(12)));
  for (const auto& [pair, inliers] : inliers_) {
    EXPECT_THAT(inliers, SizeIs(IsFakeEdge(pair) ? 20 : 0));
  }
  EXPECT_EQ(inliers_.at(ImagePair(1, 2))[3], (FeatureMatch{3, 3}));
  const std::map<ImagePair, FeatureMatches> before = std::exchange(inliers_, {});
  const std::size_t runs = CountInLog("run");
  outcomes_.clear();
  EXPECT_TRUE(Verify(AllPairs(12)));
  EXPECT_EQ(CountInLog("run"), runs);
  EXPECT_EQ(inliers_, before);
}

TEST_F(VerifierTest, InliersOfKnownPairsThatAreDamagedAreNone) {
  EXPECT_TRUE(Verify(AllPairs(12)));
  const std::map<ImagePair, PairOutcome> outcomes = std::exchange(outcomes_, {});
  sqlite::Connection(database_path_, sqlite::Access::kReadWrite, 5)
      .Execute("UPDATE two_view_geometries SET data = x'0123' WHERE rows > 0");
  EXPECT_TRUE(Verify(AllPairs(12)));
  EXPECT_EQ(outcomes_, outcomes);
  for (const auto& [pair, inliers] : inliers_) EXPECT_THAT(inliers, IsEmpty());
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("a blob of matches of the wrong size")));
}

TEST_F(VerifierTest, KnownPairsAreAnsweredWithoutColmap) {
  EXPECT_TRUE(Verify(AllPairs(10)));
  const std::size_t pairs_before = CountInLog("pair");
  outcomes_.clear();
  EXPECT_TRUE(Verify(AllPairs(12)));
  EXPECT_THAT(outcomes_, SizeIs(66));
  EXPECT_EQ(outcomes_.at(ImagePair(1, 2)), PairOutcome::kEdge);
  EXPECT_EQ(CountInLog("pair"), pairs_before + 66 - 45);
}

TEST_F(VerifierTest, ShardsDoNotDependOnTheNumberOfProcesses) {
  const auto runs = [this](int num_processes) {
    std::filesystem::remove(directory_.Path() / "log.txt");
    sqlite::Connection(database_path_, sqlite::Access::kReadWrite, 5)
        .Execute("DELETE FROM two_view_geometries");
    sqlite::Connection(database_path_, sqlite::Access::kReadWrite, 5)
        .Execute("DELETE FROM matches");
    options_.num_processes = num_processes;
    outcomes_.clear();
    Verify(AllPairs(20));
    return CountInLog("run");
  };
  const std::size_t one = runs(1);
  EXPECT_GT(one, 10U);
  EXPECT_EQ(runs(2), one);
  EXPECT_EQ(runs(7), one);
}

class Fault : public VerifierTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(Fault, OnOnePairLosesThatPairAlone) {
  Set("FAKE_COLMAP_FAULT", GetParam());
  Set("FAKE_COLMAP_FAULT_PAIR", "3 7");
  options_.timeout_per_pair = 0.5;
  EXPECT_TRUE(Verify(AllPairs(15)));
  ASSERT_THAT(outcomes_, SizeIs(105));
  for (const auto& [pair, outcome] : outcomes_) {
    EXPECT_EQ(outcome, pair == ImagePair(3, 7) ? PairOutcome::kFailed
                       : IsFakeEdge(pair)      ? PairOutcome::kEdge
                                               : PairOutcome::kNoEdge);
  }
  EXPECT_EQ(InDatabase().count(ImagePair(3, 7)), 0U);
  EXPECT_THAT(InDatabase(), SizeIs(104));
  // The user learns the names that the images have in the database, and COLMAP's last words.
  EXPECT_THAT(warnings_,
              ElementsAre(AllOf(HasSubstr("\"place0/photo 2.jpg\" and \"place1/photo 1.jpg\""),
                                HasSubstr("a made-up fault on the pair 3 7"))));
  // Another run tries the pair again, and it alone.
  ::unsetenv("FAKE_COLMAP_FAULT");
  const std::size_t pairs_before = CountInLog("pair");
  outcomes_.clear();
  EXPECT_TRUE(Verify(AllPairs(15)));
  EXPECT_EQ(CountInLog("pair"), pairs_before + 1);
  EXPECT_EQ(outcomes_.at(ImagePair(3, 7)), PairOutcome::kEdge);
}

INSTANTIATE_TEST_SUITE_P(Colmap, Fault,
                         ::testing::Values("crash", "exit", "hang", "nothing", "nonsense",
                                           "short"));

TEST_F(VerifierTest, AFaultThatPassesCostsNothing) {
  Set("FAKE_COLMAP_FAULT", "crash");
  Set("FAKE_COLMAP_FAULT_PAIR", "3 7");
  Set("FAKE_COLMAP_FAULT_TIMES", "1");
  EXPECT_TRUE(Verify(AllPairs(15)));
  EXPECT_THAT(InDatabase(), SizeIs(105));
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(VerifierTest, OneBadImageLosesItsPairsAlone) {
  Set("FAKE_COLMAP_FAULT", "crash");
  Set("FAKE_COLMAP_FAULT_IMAGE", "3");
  EXPECT_TRUE(Verify(AllPairs(25)));
  EXPECT_THAT(InDatabase(), SizeIs(300 - 24));
  EXPECT_THAT(warnings_, SizeIs(24));
}

TEST_F(VerifierTest, GivesUpWhenColmapFailsOnEverything) {
  Set("FAKE_COLMAP_FAULT", "exit");
  Set("FAKE_COLMAP_FAULT_PAIR", "all");
  try {
    Verify(AllPairs(15));
    FAIL();
  } catch (const ColmapError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("fails on every pair"), HasSubstr("exit code 1"),
                                    HasSubstr("a made-up fault")));
  }
  EXPECT_THAT(InDatabase(), IsEmpty());
}

TEST_F(VerifierTest, StopsAfterTheShardsUnderWay) {
  Set("FAKE_COLMAP_DELAY_MS", "20");
  std::thread stopper([this] {
    while (CountInLog("pair") < 20) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    stop_.Raise();
  });
  EXPECT_FALSE(Verify(AllPairs(25)));
  stopper.join();
  // All that COLMAP did is kept.
  EXPECT_EQ(InDatabase().size(), CountInLog("pair"));
  EXPECT_EQ(outcomes_.size(), InDatabase().size());
  EXPECT_LT(outcomes_.size(), 300U);
}

TEST_F(VerifierTest, AbandonsShardsWhenAskedTwice) {
  Set("FAKE_COLMAP_FAULT", "hang");
  Set("FAKE_COLMAP_FAULT_PAIR", "all");
  std::thread stopper([this] {
    while (CountInLog("fault") < 2) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    stop_.Raise();
    stop_.Raise();
  });
  EXPECT_FALSE(Verify(AllPairs(25)));
  stopper.join();
  EXPECT_THAT(InDatabase(), IsEmpty());
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(VerifierTest, OptionsAreSpeltAsTheInstalledColmapSpellsThem) {
  Set("FAKE_COLMAP_VERSION", "COLMAP 4.2.1 (Commit x on y without GPU support)");
  Set("FAKE_COLMAP_SCHEMA", "42");
  Set("FAKE_COLMAP_GROUP", "FeatureMatching");
  options_.exact.matching.max_ratio = 0.7;
  options_.geometry.max_error = 3;
  options_.geometry.min_num_inliers = 18;
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_THAT(Log(), Contains(AllOf(HasSubstr("--FeatureMatching.max_ratio=0.7"),
                                    HasSubstr("--FeatureMatching.use_gpu=0"),
                                    HasSubstr("--FeatureMatching.num_threads=1"),
                                    HasSubstr("--FeatureMatching.min_num_inliers=18"))));
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("COLMAP 4.2.1 does not have these options, which "
                                               "have no effect: TwoViewGeometry.max_error.")));
}

TEST_F(VerifierTest, GpuIsUsedWhereColmapHasOneAndTheUserWantsIt) {
  Set("FAKE_COLMAP_VERSION", "COLMAP 3.10\n(Commit x on y with CUDA)");
  Set("FAKE_COLMAP_SCHEMA", "310");
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_THAT(Log(), Contains(AllOf(HasSubstr("use_gpu=1"), HasSubstr("num_threads=2"))));
  options_.use_gpu = false;
  outcomes_.clear();
  EXPECT_TRUE(Verify({ImagePair(1, 3)}));
  EXPECT_THAT(Log(), Contains(AllOf(HasSubstr("use_gpu=0"), HasSubstr("num_threads=1"))));
}

TEST_F(VerifierTest, EdgesFollowMinNumInliers) {
  options_.geometry.min_num_inliers = 21;  // The test double finds 20.
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_EQ(outcomes_.at(ImagePair(1, 2)), PairOutcome::kNoEdge);
}

// Five images of 30 features at each of five places, whose descriptors match within a place.
class ExactMatcherTest : public VerifierTest {
 protected:
  void SetUp() override {
    VerifierTest::SetUp();
    options_.matcher = VerificationOptions::Matcher::kExact;
  }

  static bool SamePlace(const ImagePair& pair) { return (pair.id1 - 1) / 5 == (pair.id2 - 1) / 5; }

  std::string Dump() const {
    Database database(database_path_, sqlite::Access::kRead, 5);
    sqlite::Connection connection(database_path_, sqlite::Access::kRead, 5);
    std::string text;
    for (const char* table : {"matches", "two_view_geometries"}) {
      sqlite::Statement select(connection, std::string("SELECT pair_id, rows, hex(data) FROM ") +
                                               table + " ORDER BY pair_id");
      while (select.Step()) {
        text += std::to_string(select.Int(0)) + " " + std::to_string(select.Int(1)) + " " +
                select.Text(2) + "\n";
      }
    }
    return text;
  }

  void Clear() {
    outcomes_.clear();
    std::filesystem::remove(directory_.Path() / "log.txt");
    sqlite::Connection connection(database_path_, sqlite::Access::kReadWrite, 5);
    connection.Execute("DELETE FROM two_view_geometries");
    connection.Execute("DELETE FROM matches");
  }
};

TEST_F(ExactMatcherTest, ColmapOnlyGetsPairsWithEnoughMatches) {
  EXPECT_TRUE(Verify(AllPairs(25)));
  EXPECT_TRUE(matched_here_);
  ASSERT_THAT(outcomes_, SizeIs(300));
  for (const auto& [pair, outcome] : outcomes_) {
    EXPECT_EQ(outcome,
              SamePlace(pair) && IsFakeEdge(pair) ? PairOutcome::kEdge : PairOutcome::kNoEdge);
  }
  EXPECT_EQ(CountInLog("pair"), 50U);
  EXPECT_EQ(CountInLog("given"), 50U);
  EXPECT_EQ(CountInLog("descriptors of 0 images"), CountInLog("run"));
  EXPECT_THAT(Log(), Contains("given 1 2: 30"));
  EXPECT_EQ(statistics_.num_matched, 300U);
  EXPECT_EQ(statistics_.num_unmatched, 250U);
  EXPECT_EQ(statistics_.num_image_reads, 25U);
}

TEST_F(ExactMatcherTest, SaysWhereMatchesAreIfItIsAsked) {
  Database database(database_path_, sqlite::Access::kRead, 5);
  const std::vector<ImageRecord> images = database.ReadImages();
  const Keypoints keypoints1 = database.ReadKeypoints(images[0]);
  const Keypoints keypoints2 = database.ReadKeypoints(images[1]);
  const auto match = [&](ExactMatcher::Points points) {
    ExactMatcher matcher(options_.exact, points, database_path_, images, 5, 1);
    std::vector<MatchedPair> matched;
    EXPECT_TRUE(matcher.Match(
        {ImagePair(1, 2)}, [] { return false; }, &matched));
    return matched.front();
  };
  const MatchedPair without = match(ExactMatcher::Points::kLeftOut);
  EXPECT_THAT(without.points, IsEmpty());
  EXPECT_THAT(without.distinctness, IsEmpty());
  const MatchedPair with = match(ExactMatcher::Points::kGiven);
  EXPECT_EQ(with.matches, without.matches);
  ASSERT_THAT(with.points, SizeIs(with.matches.size()));
  ASSERT_THAT(with.distinctness, SizeIs(with.matches.size()));
  for (std::size_t i = 0; i < with.matches.size(); ++i) {
    const float* first = &keypoints1.data[with.matches[i].feature1 * keypoints1.num_cols];
    const float* second = &keypoints2.data[with.matches[i].feature2 * keypoints2.num_cols];
    EXPECT_EQ(with.points[i].x1, first[0]);
    EXPECT_EQ(with.points[i].y1, first[1]);
    EXPECT_EQ(with.points[i].x2, second[0]);
    EXPECT_EQ(with.points[i].y2, second[1]);
    EXPECT_GT(with.distinctness[i], 1 - options_.exact.matching.max_ratio);
    EXPECT_LE(with.distinctness[i], 1);
  }
}

TEST_F(ExactMatcherTest, UnmatchedPairsGetTheRowsOfColmap) {
  EXPECT_TRUE(Verify({ImagePair(1, 6)}));
  sqlite::Connection connection(database_path_, sqlite::Access::kRead, 5);
  sqlite::Statement matches(connection, "SELECT rows, cols, data FROM matches");
  ASSERT_TRUE(matches.Step());
  EXPECT_EQ(matches.Int(0), 0);
  EXPECT_EQ(matches.Int(1), 2);
  EXPECT_TRUE(matches.IsNull(2));
  sqlite::Statement geometry(
      connection, "SELECT rows, cols, data, config, F, E, H, qvec, tvec FROM two_view_geometries");
  ASSERT_TRUE(geometry.Step());
  EXPECT_EQ(geometry.Int(0), 0);
  EXPECT_EQ(geometry.Int(1), 2);
  EXPECT_EQ(geometry.Int(3), 0);
  for (const int column : {2, 4, 5, 6, 7, 8}) EXPECT_TRUE(geometry.IsNull(column)) << column;
}

TEST_F(ExactMatcherTest, TheResultDependsOnNeitherTheCacheNorTheThreads) {
  EXPECT_TRUE(Verify(AllPairs(25)));
  const std::string expected = Dump();
  for (const int num_threads : {1, 3, 16}) {
    Clear();
    num_threads_ = num_threads;
    options_.exact.cache_gb = 1e-9;  // One byte: nothing is kept.
    EXPECT_TRUE(Verify(AllPairs(25)));
    EXPECT_EQ(Dump(), expected) << num_threads << " threads";
    EXPECT_GT(statistics_.num_image_reads, 100U);
  }
}

TEST_F(ExactMatcherTest, MatchingFollowsTheOptions) {
  options_.exact.matching.max_distance = 0.001;
  EXPECT_TRUE(Verify(AllPairs(25)));
  EXPECT_EQ(CountInLog("pair"), 0U);
  EXPECT_EQ(statistics_.num_unmatched, 300U);
}

TEST_F(ExactMatcherTest, MatchesThatAwaitVerificationAreVerifiedAsTheyAre) {
  sqlite::Connection(database_path_, sqlite::Access::kReadWrite, 5)
      .Execute("INSERT INTO matches VALUES(2147483647 * 1 + 6, 1, 2, x'0000000000000000')");
  EXPECT_TRUE(Verify({ImagePair(1, 2), ImagePair(1, 6)}));
  EXPECT_THAT(Log(), Contains("given 1 2: 30"));
  EXPECT_THAT(Log(), Contains("given 1 6: 1"));
  EXPECT_EQ(statistics_.num_matched, 1U);
}

TEST_F(ExactMatcherTest, KeysThatColmapNeverWritesAreNoMatches) {
  // The larger id first.
  sqlite::Connection(database_path_, sqlite::Access::kReadWrite, 5)
      .Execute("INSERT INTO matches VALUES(2147483647 * 2 + 1, 1, 2, x'0000000000000000')");
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_EQ(outcomes_.at(ImagePair(1, 2)), PairOutcome::kEdge);
  EXPECT_THAT(Log(), Contains("given 1 2: 30"));
}

TEST_F(ExactMatcherTest, FeaturesThatChangeMeanwhileAreAnError) {
  Database database(database_path_, sqlite::Access::kReadWrite, 5);
  const std::vector<ImageRecord> images = database.ReadImages();
  const WorkDirectory work(directory_.Path());
  const ColmapInstallation colmap = DetectColmap(FAKE_COLMAP_PATH, work.Path(), stop_);
  const auto ignore = [](const std::string&) {};
  const VerificationPlan plan = PlanVerification(options_, num_threads_, colmap);
  ColmapVerifier geometry(options_, plan, colmap, database_path_, images, work.Path(), stop_,
                          ignore);
  BatchVerifier verifier(options_, plan, geometry, database, images, stop_, ignore);
  sqlite::Connection(database_path_, sqlite::Access::kReadWrite, 5)
      .Execute("DELETE FROM descriptors WHERE image_id = 3");
  try {
    verifier.Verify(AllPairs(25), [](const VerifiedPair&) {});
    FAIL();
  } catch (const DatabaseError& error) {
    EXPECT_THAT(error.what(), HasSubstr("place0/photo 2.jpg"));
  }
  for (const ImagePair& pair : InDatabase()) {
    EXPECT_NE(pair.id1, 3U);
    EXPECT_NE(pair.id2, 3U);
  }
}

TEST_F(ExactMatcherTest, ImagesWithTooManyFeaturesAreMentioned) {
  options_.exact.matching.max_num_matches = 29;
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_THAT(warnings_, Contains(HasSubstr("25 images have more than 29 features")));
  EXPECT_THAT(Log(), Contains("given 1 2: 29"));
}

TEST_F(ExactMatcherTest, ColmapGetsManyPairsAtATimeThoughFewHaveMatches) {
  EXPECT_TRUE(Verify(AllPairs(25)));
  EXPECT_EQ(CountInLog("pair"), 50U);
  EXPECT_LE(CountInLog("run"), 10U);
}

TEST_F(ExactMatcherTest, GuidedMatchingNeedsDescriptors) {
  options_.geometry.guided_matching = true;
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_THAT(Log(), Contains("descriptors of 2 images"));
}

TEST_F(ExactMatcherTest, AutoMatchesHereUnlessColmapHasAGpu) {
  options_.matcher = VerificationOptions::Matcher::kAuto;
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_TRUE(matched_here_);
  Set("FAKE_COLMAP_VERSION", "COLMAP 3.10\n(Commit x on y with CUDA)");
  Set("FAKE_COLMAP_SCHEMA", "310");
  outcomes_.clear();
  EXPECT_TRUE(Verify({ImagePair(1, 3)}));
  EXPECT_FALSE(matched_here_);
  options_.use_gpu = false;
  outcomes_.clear();
  EXPECT_TRUE(Verify({ImagePair(1, 4)}));
  EXPECT_TRUE(matched_here_);
  // COLMAP only verifies, for which it has no use for a GPU.
  options_.use_gpu = true;
  options_.matcher = VerificationOptions::Matcher::kExact;
  outcomes_.clear();
  EXPECT_TRUE(Verify({ImagePair(1, 5)}));
  EXPECT_TRUE(matched_here_);
  EXPECT_THAT(Log().back(), HasSubstr("1 5"));
  EXPECT_EQ(CountInLog("run"), 4U);
  const std::vector<std::string> log = Log();
  const auto last_run = std::find_if(
      log.rbegin(), log.rend(), [](const std::string& line) { return line.rfind("run ", 0) == 0; });
  ASSERT_NE(last_run, log.rend());
  EXPECT_THAT(*last_run, HasSubstr("use_gpu=0"));
}

TEST_F(ExactMatcherTest, ACrashOfColmapLosesOnePair) {
  Set("FAKE_COLMAP_FAULT", "crash");
  Set("FAKE_COLMAP_FAULT_PAIR", "3 4");
  EXPECT_TRUE(Verify(AllPairs(25)));
  EXPECT_EQ(outcomes_.at(ImagePair(3, 4)), PairOutcome::kFailed);
  EXPECT_THAT(InDatabase(), SizeIs(299));
}

TEST_F(ExactMatcherTest, UnmatchedPairsDoNotHideThatColmapFails) {
  Set("FAKE_COLMAP_FAULT", "exit");
  Set("FAKE_COLMAP_FAULT_PAIR", "all");
  EXPECT_THROW(Verify(AllPairs(25)), ColmapError);
}

TEST_F(ExactMatcherTest, WrongOptions) {
  options_.exact.cache_gb = -1;
  EXPECT_THROW(options_.Check(), OptionsError);
  options_.exact.cache_gb = 0;
  options_.exact.cache_gb = 1e300;
  options_.Check();
  options_.exact.cache_gb = std::numeric_limits<double>::infinity();
  EXPECT_THROW(options_.Check(), OptionsError);
  options_.exact.cache_gb = 0;
  options_.colmap_options = {{"max_ratio", "0.7"}};  // Its place is exact.matching.
  EXPECT_THROW(options_.Check(), OptionsError);
  options_.colmap_options.clear();
  options_.exact.matching.max_ratio = 0;
  EXPECT_THROW(options_.Check(), OptionsError);
}

class DetectTest : public VerifierTest {
 protected:
  std::string MessageOf(const std::string& colmap_path) const {
    try {
      DetectColmap(colmap_path, directory_.Path(), stop_);
    } catch (const ColmapError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(DetectTest, ReadsTheVersionAndTheGpu) {
  const auto detect = [this](const std::string& text) {
    Set("FAKE_COLMAP_VERSION", text);
    return DetectColmap(FAKE_COLMAP_PATH, directory_.Path(), stop_);
  };
  const ColmapInstallation old =
      detect("COLMAP 3.8 -- Structure-from-Motion\n(Commit a on b without CUDA)");
  EXPECT_EQ(old.Version(), "3.8");
  EXPECT_FALSE(old.has_gpu);
  EXPECT_TRUE(detect("COLMAP 3.10-dev -- x\n(Commit a on b with CUDA)").has_gpu);
  const ColmapInstallation recent = detect("COLMAP 4.2.1 (Commit a on b with GPU support, std)");
  EXPECT_EQ(recent.Version(), "4.2.1");
  EXPECT_TRUE(recent.has_gpu);
  EXPECT_FALSE(detect("COLMAP 4.2.1 (Commit a on b without GPU support)").has_gpu);
}

TEST_F(DetectTest, MissingProgram) {
  EXPECT_THAT(
      MessageOf("no-such-colmap"),
      AllOf(HasSubstr("no program \"no-such-colmap\" on the PATH"), HasSubstr("--colmap_path")));
  EXPECT_THAT(MessageOf("/nowhere/colmap"), HasSubstr("no program at /nowhere/colmap"));
}

TEST_F(DetectTest, NotColmap) {
  EXPECT_THAT(MessageOf("/bin/echo"), HasSubstr("is not COLMAP"));
  EXPECT_THAT(MessageOf("/bin/false"), HasSubstr("ended with exit code 1"));
}

TEST_F(DetectTest, TooOld) {
  Set("FAKE_COLMAP_VERSION", "COLMAP 3.7 -- x\n(without CUDA)");
  EXPECT_THAT(MessageOf(FAKE_COLMAP_PATH),
              AllOf(HasSubstr("is COLMAP 3.7"), HasSubstr("3.8 or later")));
}

TEST(Subprocess, ReportsHowItEnded) {
  const TestDirectory directory;
  const auto run = [&](const std::string& script, double timeout = 0) {
    return RunSubprocess({"/bin/sh", "-c", script}, directory.Path() / "out.txt", timeout, Never);
  };
  EXPECT_TRUE(run("echo to stdout; echo to stderr >&2").Succeeded());
  EXPECT_EQ(LastLines(directory.Path() / "out.txt", 9), "to stdout\nto stderr");
  EXPECT_EQ(LastLines(directory.Path() / "out.txt", 1), "to stderr");
  EXPECT_EQ(run("exit 7").exit_code, 7);
  const SubprocessResult killed = run("kill -ABRT $$");
  EXPECT_EQ(killed.ending, SubprocessResult::Ending::kSignal);
  EXPECT_EQ(killed.signal, SIGABRT);
  EXPECT_THAT(killed.Describe(), HasSubstr("signal 6"));
  // What it started dies with it.
  const SubprocessResult hanging = run("sleep 1000 & echo $!; wait", 0.5);
  EXPECT_EQ(hanging.ending, SubprocessResult::Ending::kTimedOut);
  const pid_t grandchild = std::stoi(LastLines(directory.Path() / "out.txt", 1));
  // A signal is sent, not awaited, and whoever inherits the dead takes its time to bury them. Were
  // it not killed, this would last until the test's own time limit.
  const auto lives = [&] {
    std::string pid, name, state = "Z";
    std::ifstream("/proc/" + std::to_string(grandchild) + "/stat") >> pid >> name >> state;
    return state != "Z" && state != "X";
  };
  while (lives()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

// Signals are blocked while a program is started, but not in it; what we ignore it does not.
TEST(Subprocess, SignalsAreThoseOfAFreshProgram) {
  const TestDirectory directory;
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  const auto before_user = std::signal(SIGUSR1, [](int) {});
  EXPECT_TRUE(RunSubprocess({"/bin/sed", "-n", "/^Sig[BIC]/p", "/proc/self/status"},
                            directory.Path() / "out.txt", 0, Never)
                  .Succeeded());
  const std::string none = "\t0000000000000000";
  EXPECT_EQ(LastLines(directory.Path() / "out.txt", 9),
            "SigBlk:" + none + "\nSigIgn:" + none + "\nSigCgt:" + none);
  std::signal(SIGPIPE, before);
  std::signal(SIGUSR1, before_user);
}

TEST(Subprocess, CanBeStopped) {
  const TestDirectory directory;
  std::atomic<int> polls{0};
  const SubprocessResult result = RunSubprocess({"/bin/sleep", "100"}, directory.Path() / "out.txt",
                                                0, [&] { return ++polls > 3; });
  EXPECT_EQ(result.ending, SubprocessResult::Ending::kStopped);
}

TEST(Subprocess, ThatCannotStart) {
  const TestDirectory directory;
  EXPECT_THROW(RunSubprocess({"/nowhere/program"}, directory.Path() / "out.txt", 0, Never),
               ColmapError);
}

// The same, with a fit in this process. The features of a place are at the same spots in every
// image, but for those that a test moves.
class InProcessTest : public ExactMatcherTest {
 protected:
  // Moves the features of an image from the given row on to random spots.
  void Scatter(ImageId image, std::size_t first) {
    Keypoints keypoints = Database(database_path_, sqlite::Access::kRead, 5).ReadKeypoints(image);
    Random random({image});
    for (std::size_t row = first; row < keypoints.num_rows; ++row) {
      float* keypoint = keypoints.data.data() + row * keypoints.num_cols;
      keypoint[0] = static_cast<float>(800 * random.Uniform());
      keypoint[1] = static_cast<float>(600 * random.Uniform());
    }
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(keypoints.data.data());
    const sqlite::Blob data(bytes, bytes + keypoints.data.size() * sizeof(float));
    sqlite::Connection connection(database_path_, sqlite::Access::kReadWrite, 5);
    sqlite::Statement update(connection, "UPDATE keypoints SET data = ?1 WHERE image_id = ?2");
    update.Bind(1, data).Bind(2, std::int64_t{image}).Run();
  }

  std::size_t NumMatches(const ImagePair& pair) const {
    return Database(database_path_, sqlite::Access::kRead, 5).ReadMatches(pair).size();
  }
};

TEST_F(InProcessTest, ColmapIsTheJudgeOfWhatIsLikely) {
  options_.verifier = VerificationOptions::Verifier::kScreened;
  options_.geometry.min_num_inliers = 8;
  EXPECT_TRUE(Verify(AllPairs(25)));
  for (const auto& [pair, outcome] : outcomes_) {
    EXPECT_EQ(outcome,
              SamePlace(pair) && IsFakeEdge(pair) ? PairOutcome::kEdge : PairOutcome::kNoEdge);
  }
  EXPECT_EQ(CountInLog("pair"), 50U);
  EXPECT_EQ(fits_.num_fitted, 50U);
  EXPECT_EQ(fits_.num_settled, 0U);
  EXPECT_EQ(NumMatches(ImagePair(1, 2)), 30U);
}

// There it would reject pairs instead.
TEST_F(InProcessTest, RecentVersionsGetNoInlierRatio) {
  options_.verifier = VerificationOptions::Verifier::kScreened;
  Set("FAKE_COLMAP_VERSION", "COLMAP 4.2.1 (Commit x on y without GPU support)");
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_THAT(Log(), Contains(HasSubstr("max_num_trials=")));
  EXPECT_THAT(Log(), Not(Contains(HasSubstr("min_inlier_ratio="))));
}

TEST_F(InProcessTest, HopelessPairsAreSettledAndKeepTheirMatches) {
  options_.verifier = VerificationOptions::Verifier::kScreened;
  Scatter(2, 0);
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_EQ(outcomes_.at(ImagePair(1, 2)), PairOutcome::kNoEdge);
  EXPECT_EQ(fits_.num_settled, 1U);
  EXPECT_EQ(CountInLog("pair"), 0U);
  EXPECT_EQ(NumMatches(ImagePair(1, 2)), 30U);
  sqlite::Connection connection(database_path_, sqlite::Access::kRead, 5);
  sqlite::Statement select(connection, "SELECT rows, config, data, F FROM two_view_geometries");
  ASSERT_TRUE(select.Step());
  EXPECT_EQ(select.Int(0), 0);
  EXPECT_EQ(select.Int(1), 0);
  EXPECT_TRUE(select.IsNull(2));
  EXPECT_TRUE(select.IsNull(3));
}

TEST_F(InProcessTest, ColmapGetsTheMatchesNearAModelAndAsManyOthersOfAClosePair) {
  options_.verifier = VerificationOptions::Verifier::kScreened;
  options_.geometry.min_num_inliers = 8;
  Scatter(2, 24);
  Scatter(3, 10);
  EXPECT_TRUE(Verify({ImagePair(1, 2), ImagePair(1, 3)}));
  const auto given = [this](const std::string& pair) {
    for (const std::string& line : Log()) {
      const std::string beginning = "given " + pair + ": ";
      if (line.rfind(beginning, 0) == 0) return std::stoi(line.substr(beginning.size()));
    }
    return 0;
  };
  EXPECT_GE(given("1 2"), 24);
  EXPECT_LT(given("1 2"), 30);
  EXPECT_GE(given("1 3"), 20);
  EXPECT_LT(given("1 3"), 30);
  EXPECT_THAT(Log(), Contains(AllOf(HasSubstr("--SiftMatching.max_num_trials=2643"),
                                    HasSubstr("--SiftMatching.min_inlier_ratio=0.5"))));
  EXPECT_EQ(NumMatches(ImagePair(1, 2)), 30U);
  EXPECT_EQ(NumMatches(ImagePair(1, 3)), 30U);
}

TEST_F(InProcessTest, WhatTheFitCannotJudgeGoesToColmapWhole) {
  options_.verifier = VerificationOptions::Verifier::kScreened;
  sqlite::Connection(database_path_, sqlite::Access::kReadWrite, 5)
      .Execute("UPDATE cameras SET params = zeroblob(8)");
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_EQ(fits_.num_fitted, 0U);
  EXPECT_THAT(Log(), Contains("given 1 2: 30"));
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("25 images have cameras")));
}

// What is settled here does not show that COLMAP works.
TEST_F(InProcessTest, HopelessPairsDoNotHideThatColmapFails) {
  options_.verifier = VerificationOptions::Verifier::kScreened;
  for (ImageId image = 2; image <= 25; image += 2) Scatter(image, 0);
  Set("FAKE_COLMAP_FAULT", "exit");
  Set("FAKE_COLMAP_FAULT_PAIR", "all");
  EXPECT_THROW(Verify(AllPairs(25)), ColmapError);
}

TEST_F(InProcessTest, WhatColmapRejectsByInlierRatioItGetsWhole) {
  options_.verifier = VerificationOptions::Verifier::kScreened;
  options_.geometry.min_inlier_ratio = 0.3;
  ColmapInstallation colmap;
  colmap.major = 4;
  colmap.minor = 1;
  EXPECT_EQ(PlanVerification(options_, 1, colmap).verifier,
            VerificationOptions::Verifier::kScreened);
  colmap.minor = 2;
  EXPECT_EQ(PlanVerification(options_, 1, colmap).verifier, VerificationOptions::Verifier::kColmap);
  options_.geometry.min_inlier_ratio = 0;
  EXPECT_EQ(PlanVerification(options_, 1, colmap).verifier,
            VerificationOptions::Verifier::kScreened);
}

TEST_F(InProcessTest, AutoIsScreenedWhereThereIsAColmap) {
  using Verifier = VerificationOptions::Verifier;
  options_ = VerificationOptions();
  EXPECT_EQ(PlanVerification(options_, 1, ColmapInstallation()).verifier, Verifier::kScreened);
  EXPECT_EQ(PlanVerification(options_, 1, std::nullopt).verifier, Verifier::kNative);
  EXPECT_TRUE(CanDoWithoutColmap(options_));
  ColmapInstallation with_gpu;
  with_gpu.has_gpu = true;
  EXPECT_EQ(PlanVerification(options_, 1, with_gpu).verifier, Verifier::kColmap);
  options_.geometry.guided_matching = true;
  EXPECT_EQ(PlanVerification(options_, 1, ColmapInstallation()).verifier, Verifier::kColmap);
  EXPECT_FALSE(CanDoWithoutColmap(options_));
  options_ = VerificationOptions();
  options_.matcher = VerificationOptions::Matcher::kColmap;
  EXPECT_FALSE(CanDoWithoutColmap(options_));
  options_ = VerificationOptions();
  options_.verifier = Verifier::kScreened;
  EXPECT_FALSE(CanDoWithoutColmap(options_));
}

TEST_F(InProcessTest, WhatOnlyColmapHasGoesToColmap) {
  options_.verifier = VerificationOptions::Verifier::kScreened;
  options_.geometry.multiple_models = true;
  EXPECT_EQ(PlanVerification(options_, num_threads_, {}).verifier,
            VerificationOptions::Verifier::kColmap);
  options_.verifier = VerificationOptions::Verifier::kNative;
  EXPECT_THROW(options_.Check(), OptionsError);
  options_.geometry.multiple_models = false;
  EXPECT_EQ(PlanVerification(options_, num_threads_, {}).verifier,
            VerificationOptions::Verifier::kNative);
  options_.matcher = VerificationOptions::Matcher::kColmap;
  EXPECT_THROW(options_.Check(), OptionsError);
}

TEST_F(InProcessTest, NativelyWithoutColmapOnAnyNumberOfThreads) {
  options_.verifier = VerificationOptions::Verifier::kNative;
  Scatter(2, 0);
  std::string dump;
  for (const int num_threads : {1, 3}) {
    Clear();
    num_threads_ = num_threads;
    EXPECT_TRUE(Verify(AllPairs(25)));
    for (const auto& [pair, outcome] : outcomes_) {
      const bool is_edge = SamePlace(pair) && pair.id1 != 2 && pair.id2 != 2;
      EXPECT_EQ(outcome, is_edge ? PairOutcome::kEdge : PairOutcome::kNoEdge);
    }
    EXPECT_EQ(CountInLog("run"), 0U);
    EXPECT_EQ(fits_.num_fitted, 50U);
    if (num_threads > 1) {
      EXPECT_EQ(Dump(), dump);
    }
    dump = Dump();
  }
  // One homography fits all.
  sqlite::Connection connection(database_path_, sqlite::Access::kRead, 5);
  sqlite::Statement select(connection,
                           "SELECT count(*) FROM two_view_geometries WHERE rows = 30 AND config = "
                           "6 AND length(H) = 72");
  select.Step();
  EXPECT_EQ(select.Int(0), 46);
}

TEST_F(InProcessTest, OptionsThatOnlyColmapHasAreMentioned) {
  options_.verifier = VerificationOptions::Verifier::kNative;
  options_.geometry.use_degensac = true;
  options_.geometry.random_seed = 3;
  EXPECT_TRUE(Verify({ImagePair(1, 2)}));
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("have no effect: random_seed, use_degensac.")));
}

TEST_F(InProcessTest, MatchesThatAwaitVerificationAreVerifiedNativelyToo) {
  options_.verifier = VerificationOptions::Verifier::kNative;
  {
    // Two images of different places: what is imported counts, not what descriptors say.
    FeatureMatches matches;
    for (std::uint32_t i = 0; i < 25; ++i) matches.push_back({i, i});
    sqlite::Connection connection(database_path_, sqlite::Access::kReadWrite, 5);
    sqlite::Statement insert(connection, "INSERT INTO matches VALUES(?1, ?2, ?3, ?4)");
    insert.Bind(1, static_cast<std::int64_t>(EncodePair(ImagePair(1, 9))));
    BindMatches(matches, 2, &insert);
    insert.Run();
  }
  EXPECT_TRUE(Verify({ImagePair(1, 9)}));
  EXPECT_EQ(outcomes_.at(ImagePair(1, 9)), PairOutcome::kEdge);
  EXPECT_THAT(inliers_.at(ImagePair(1, 9)), SizeIs(25));
}

// Fails on shards with one of these pairs, and notes the sizes of all.
class FailingOn : public GeometryVerifier {
 public:
  explicit FailingOn(std::set<ImagePair> pairs, int times = 1000000)
      : guilty_(std::move(pairs)), times_(times) {}

  ShardOutcome Verify(const std::vector<PairToVerify>& pairs,
                      const std::function<bool()>& /*should_stop*/) override {
    sizes.push_back(pairs.size());
    ShardOutcome outcome;
    for (const PairToVerify& pair : pairs) {
      if (guilty_.count(pair.pair) > 0 && times_ > 0) outcome.problem = "failed";
      PairGeometry result;
      result.pair = pair.pair;
      outcome.results.push_back(result);
    }
    if (!outcome.problem.empty()) --times_;
    return outcome;
  }
  TwoViewConfiguration ConfigurationOfUnmatched() const override {
    return TwoViewConfiguration::kUndefined;
  }

  std::vector<std::size_t> sizes;

 private:
  std::set<ImagePair> guilty_;
  int times_;
};

class KeepingProgress : public ShardRunner::Progress {
 public:
  void Finish(ShardPart part) override {
    for (const PairGeometry& result : part.results) verified.insert(result.pair);
    for (const ShardPart::Failure& failure : part.failures) failed.insert(failure.first);
  }
  bool GivesUp() const override { return gives_up; }

  std::set<ImagePair> verified;
  std::set<ImagePair> failed;
  bool gives_up = false;
};

std::vector<PairToVerify> ShardOf(const std::vector<ImagePair>& pairs) {
  std::vector<PairToVerify> shard;
  for (const ImagePair& pair : pairs) shard.push_back({pair, std::nullopt});
  return shard;
}

TEST(FaultIsolation, FindsTheGuiltyPairs) {
  const std::set<ImagePair> guilty = {ImagePair(1, 2), ImagePair(3, 5)};
  FailingOn verifier(guilty);
  KeepingProgress progress;
  VerifyAndIsolate(verifier, ShardOf(AllPairs(9)), progress);
  EXPECT_EQ(progress.failed, guilty);
  EXPECT_EQ(progress.verified.size(), 34U);
}

TEST(FaultIsolation, TriesTheWholeShardAgainFirst) {
  FailingOn verifier({ImagePair(1, 2)}, 1);
  KeepingProgress progress;
  VerifyAndIsolate(verifier, ShardOf(AllPairs(5)), progress);
  EXPECT_THAT(verifier.sizes, ElementsAre(10, 10));
  EXPECT_THAT(progress.verified, SizeIs(10));
}

TEST(FaultIsolation, GivesUpWhenAsked) {
  FailingOn verifier({ImagePair(1, 2)});
  KeepingProgress progress;
  progress.gives_up = true;
  VerifyAndIsolate(verifier, ShardOf(AllPairs(5)), progress);
  EXPECT_THAT(verifier.sizes, IsEmpty());
}

class RunnerTest : public ::testing::Test {
 protected:
  static std::deque<ShardRunner::Shard> Shards(ImageId num) {
    std::deque<ShardRunner::Shard> shards;
    for (ImageId i = 1; i <= num; ++i) shards.push_back({ImagePair(i, 1000), ImagePair(i, 1001)});
    return shards;
  }

  static ShardPart PartOf(const ShardRunner::Shard& shard) {
    ShardPart part;
    for (const ImagePair& pair : shard) {
      part.results.emplace_back();
      part.results.back().pair = pair;
    }
    return part;
  }

  // Counts the pairs that arrive, on the calling thread.
  std::function<void(const ShardPart&)> Count() {
    return [this, caller = std::this_thread::get_id()](const ShardPart& part) {
      EXPECT_EQ(std::this_thread::get_id(), caller);
      num_pairs_ += part.results.size();
    };
  }

  StopRequest stop_;
  std::size_t num_pairs_ = 0;
};

TEST_F(RunnerTest, EveryShardIsWorkedOnOnce) {
  for (const std::size_t num_workers : {1, 2, 7}) {
    num_pairs_ = 0;
    ShardRunner(num_workers, stop_)
        .Run(
            Shards(50),
            [](const ShardRunner::Shard& shard, ShardRunner::Progress& progress) {
              progress.Finish(PartOf(shard));
            },
            Count());
    EXPECT_EQ(num_pairs_, 100U);
  }
}

TEST_F(RunnerTest, AWorkerWithoutRoomLeavesItsShardToTheOthers) {
  std::atomic<int> num_running{0};
  ShardRunner runner(6, stop_);
  for (int run = 0; run < 2; ++run) {
    num_pairs_ = 0;
    runner.Run(
        Shards(60),
        [&](const ShardRunner::Shard& shard, ShardRunner::Progress& progress) {
          // The system has room for two, and the first pair of a shard is done before it shows.
          const bool has_room = ++num_running <= 2;
          if (!has_room) progress.Finish(PartOf({shard.front()}));
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
          --num_running;
          if (!has_room) throw SystemLimitError("no more");
          progress.Finish(PartOf(shard));
        },
        Count());
    EXPECT_EQ(num_pairs_, 120U);
  }
}

TEST_F(RunnerTest, WithoutRoomForAnyItEndsWithTheError) {
  EXPECT_THROW(ShardRunner(3, stop_).Run(
                   Shards(60),
                   [](const ShardRunner::Shard&, ShardRunner::Progress&) {
                     throw SystemLimitError("none at all");
                   },
                   Count()),
               SystemLimitError);
}

TEST_F(RunnerTest, AnErrorOfAWorkerOrOfTheMergeEndsAll) {
  const auto finish = [](const ShardRunner::Shard& shard, ShardRunner::Progress& progress) {
    progress.Finish(PartOf(shard));
  };
  EXPECT_THROW(ShardRunner(3, stop_).Run(
                   Shards(60),
                   [&](const ShardRunner::Shard& shard, ShardRunner::Progress& progress) {
                     if (shard.front().id1 == 30) throw DatabaseError("gone");
                     finish(shard, progress);
                   },
                   Count()),
               DatabaseError);
  EXPECT_THROW(ShardRunner(3, stop_).Run(Shards(60), finish,
                                         [](const ShardPart&) { throw DatabaseError("full"); }),
               DatabaseError);
}

TEST_F(RunnerTest, AStopRequestLeavesShardsOut) {
  ShardRunner(2, stop_).Run(
      Shards(60),
      [this](const ShardRunner::Shard& shard, ShardRunner::Progress& progress) {
        if (shard.front().id1 == 10) stop_.Raise();
        progress.Finish(PartOf(shard));
      },
      Count());
  EXPECT_GE(num_pairs_, 20U);
  EXPECT_LT(num_pairs_, 120U);
}

TEST_F(VerifierTest, NamesOfImagesReachNoShellAndNoListOfPairs) {
  const std::string mark = (directory_.Path() / "mark").string();
  std::vector<SyntheticImage> images = MakePlaces(1, 6, 30, 1);
  const std::vector<std::string> names = {"$(touch '" + mark + "')",    "`touch '" + mark + "'`",
                                          "'; touch '" + mark + "'; '", "| touch '" + mark + "' #",
                                          "--help\ntouch mark",         "../../a b\t\x1B]0;c"};
  for (std::size_t i = 0; i < images.size(); ++i) images[i].name = names[i];
  std::filesystem::remove(database_path_);
  WriteSyntheticDatabase(database_path_, Schema::kColmap38, images);
  Set("FAKE_COLMAP_FAULT", "crash");
  Set("FAKE_COLMAP_FAULT_PAIR", "1 2");
  EXPECT_TRUE(Verify(AllPairs(6)));
  EXPECT_EQ(CountInLog("pair 3 4"), 1U);
  EXPECT_EQ(InDatabase().size(), 14U);
  ASSERT_THAT(warnings_, SizeIs(1));
  EXPECT_THAT(warnings_[0], HasSubstr(names[0]));
  EXPECT_FALSE(std::filesystem::exists(mark));
  EXPECT_GT(CountInLog("private directory"), 0U);
  EXPECT_EQ(CountInLog("open directory"), 0U);
}

TEST(Subprocess, ArgumentsReachNoShell) {
  const TestDirectory directory;
  RunSubprocess({"/bin/echo", "$(touch x); `id` 'a b'"}, directory.Path() / "out.txt", 0, Never);
  EXPECT_EQ(LastLines(directory.Path() / "out.txt", 1), "$(touch x); `id` 'a b'");
}

TEST(WorkDirectory, IsPrivateAndGoesAway) {
  const TestDirectory directory;
  std::filesystem::path path;
  {
    const WorkDirectory work(directory.Path());
    path = work.Path();
    EXPECT_EQ(std::filesystem::status(path).permissions(), std::filesystem::perms::owner_all);
    std::ofstream(path / "file") << "x";
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_THROW(WorkDirectory("/nowhere"), FileError);
}

}  // namespace
}  // namespace colmap_graphmatch
