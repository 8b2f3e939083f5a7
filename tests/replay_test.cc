#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/colmap_graphmatch.h"
#include "colmap_graphmatch/encoding/numpy_file.h"
#include "colmap_graphmatch/files/finished_graph.h"
#include "colmap_graphmatch/files/ranked_lists.h"
#include "colmap_graphmatch/report/exports.h"
#include "colmap_graphmatch/report/json_report.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class TextFileTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& text) {
    std::ofstream(path_) << text;
    return path_;
  }

  TestDirectory directory_;
  std::filesystem::path path_ = directory_.Path() / "file.tsv";
  std::vector<ImageRecord> images_ = {
      {1, "a.jpg", 1}, {2, "b b.jpg", 1}, {4, "c.jpg", 1}, {5, "none.jpg", 0}};
};

class FinishedGraphTest : public TextFileTest {
 protected:
  FinishedGraph Read(const std::string& text) {
    return ReadFinishedGraph(Write(text), images_, 15, 1);
  }
};

TEST_F(FinishedGraphTest, LinesOfEdges) {
  const FinishedGraph graph = Read(
      "# a comment\nphoto1\tphoto2\tinliers\tconfig\tmatches\n"
      "b b.jpg\ta.jpg\t20\t3\t50\na.jpg\tc.jpg\t30\t1\t40\nb b.jpg\tc.jpg\t10\t2\t12\n"
      "a.jpg\tnone.jpg\t20\t3\t50\n");
  ASSERT_THAT(graph.pairs, SizeIs(3));
  const ReplayedPair& edge = graph.pairs.at(ImagePair(1, 2));
  EXPECT_TRUE(edge.is_edge);
  EXPECT_TRUE(edge.is_verified);
  EXPECT_EQ(edge.num_inliers, 20U);
  const ReplayedPair& degenerate = graph.pairs.at(ImagePair(1, 4));
  EXPECT_FALSE(degenerate.is_edge);
  EXPECT_TRUE(degenerate.is_verified);
  const ReplayedPair& too_few = graph.pairs.at(ImagePair(2, 4));
  EXPECT_FALSE(too_few.is_edge);
  EXPECT_FALSE(too_few.is_verified);
  EXPECT_EQ(graph.num_edges, 1U);
  EXPECT_EQ(graph.num_skipped, 1U);
  EXPECT_EQ(graph.first_skipped, "a.jpg\tnone.jpg");
}

TEST_F(FinishedGraphTest, ConfigurationAndMatchesMayBeLeftOut) {
  const FinishedGraph graph = Read("a.jpg\tc.jpg\t15\n");
  EXPECT_TRUE(graph.pairs.at(ImagePair(1, 4)).is_edge);
  EXPECT_TRUE(graph.pairs.at(ImagePair(1, 4)).is_verified);
}

TEST_F(FinishedGraphTest, WhatIsNoList) {
  EXPECT_THAT([&] { Read("a.jpg\tc.jpg\t15\na.jpg c.jpg 15\n"); },
              ThrowsMessage<FileError>(HasSubstr("Line 2 of " + path_.string())));
  EXPECT_THAT([&] { Read("a.jpg\tc.jpg\t15\na.jpg\tc.jpg\t-3\n"); },
              ThrowsMessage<FileError>(HasSubstr("Line 2")));
  EXPECT_THAT([&] { Read("a.jpg\tc.jpg\t15\na.jpg\tc.jpg\t4294967311\n"); },
              ThrowsMessage<FileError>(HasSubstr("Line 2")));
  EXPECT_THAT([&] { Read("x.jpg\ty.jpg\t15\n"); },
              ThrowsMessage<FileError>(HasSubstr("the first pair is \"x.jpg\ty.jpg\"")));
  EXPECT_THAT([&] { Read("a.jpg\tc.jpg\t14\n"); },
              ThrowsMessage<FileError>(HasSubstr("Has it been matched?")));
  EXPECT_THROW(ReadFinishedGraph(directory_.Path() / "none", images_, 15, 1), FileError);
}

TEST_F(FinishedGraphTest, ADatabaseWhoseImagesHaveOtherIds) {
  const std::filesystem::path path = directory_.Path() / "matched.db";
  Descriptors descriptors;
  descriptors.num_rows = 30;
  descriptors.data.resize(30 * kDescriptorDim, 1);
  WriteSyntheticDatabase(
      path, Schema::kColmap38,
      {{"c.jpg", descriptors, {}}, {"a.jpg", descriptors, {}}, {"b b.jpg", descriptors, {}}});
  {
    Database database(path, sqlite::Access::kReadWrite, 1);
    PairGeometry edge;
    edge.pair = ImagePair(1, 2);
    for (std::uint32_t i = 0; i < 20; ++i) edge.matches.push_back({i, i + 10});
    edge.geometry.inliers = edge.matches;
    edge.geometry.configuration = TwoViewConfiguration::kUncalibrated;
    PairGeometry none;
    none.pair = ImagePair(2, 3);
    none.matches = FeatureMatches(17);
    none.geometry.configuration = TwoViewConfiguration::kDegenerate;
    database.WritePairs({edge, none});
  }
  const FinishedGraph graph = ReadFinishedGraph(path, images_, 15, 1);
  ASSERT_THAT(graph.pairs, SizeIs(2));
  EXPECT_TRUE(graph.pairs.at(ImagePair(1, 4)).is_edge);
  EXPECT_FALSE(graph.pairs.at(ImagePair(1, 2)).is_edge);
  EXPECT_TRUE(graph.pairs.at(ImagePair(1, 2)).is_verified);
  // The image of the greater id is the first one there.
  const FeatureMatches inliers = graph.read_inliers(ImagePair(1, 4));
  ASSERT_THAT(inliers, SizeIs(20));
  EXPECT_EQ(inliers.front(), (FeatureMatch{10, 0}));
  EXPECT_THAT(graph.read_inliers(ImagePair(1, 2)), IsEmpty());
  EXPECT_THAT(graph.read_inliers(ImagePair(1, 99)), IsEmpty());
}

TEST_F(FinishedGraphTest, OfAPairThatIsThereTwiceTheLastLineCounts) {
  const FinishedGraph graph =
      Read("a.jpg\tc.jpg\t20\nc.jpg\ta.jpg\t3\na.jpg\tb b.jpg\t5\nb b.jpg\ta.jpg\t30\n");
  EXPECT_EQ(graph.num_edges, 1U);
  EXPECT_FALSE(graph.pairs.at(ImagePair(1, 4)).is_edge);
}

class RankedListsTest : public TextFileTest {
 protected:
  RankedLists Read(const std::string& text) {
    return ReadRankedLists(Write(text), WithFeatures(images_));
  }
};

TEST_F(RankedListsTest, GreaterScoresAreNearer) {
  const RankedLists lists =
      Read("a.jpg\tc.jpg\t0.25\na.jpg\tb b.jpg\t0.5\nc.jpg\tnone.jpg\t1\nc.jpg\tc.jpg\t1\n");
  EXPECT_THAT(lists.ranking->NearestOf(0), ElementsAre(1, 2));
  EXPECT_THAT(lists.ranking->AllOf(0), ElementsAre(1, 2));
  EXPECT_THAT(lists.ranking->NearestOf(2), IsEmpty());
  EXPECT_EQ(lists.ranking->Distance(2, 0), -0.25F);
  EXPECT_GT(lists.ranking->Distance(1, 2), 1e30F);
  EXPECT_EQ(lists.num_skipped, 1U);
  EXPECT_EQ(lists.first_skipped, "c.jpg\tnone.jpg\t1");
}

TEST_F(RankedListsTest, WhatIsNoList) {
  for (const char* line : {"a.jpg\tc.jpg\n", "a.jpg\tc.jpg\tnear\n", "a.jpg\tc.jpg\tnan\n",
                           "a.jpg c.jpg 0.5\n", "a.jpg\tc.jpg\t1\t2\n"}) {
    EXPECT_THAT([&] { Read(std::string("a.jpg\tc.jpg\t1\n") + line); },
                ThrowsMessage<FileError>(HasSubstr("Line 2 of " + path_.string())));
  }
  EXPECT_THROW(Read("x\ty\t1\n"), FileError);
}

class Silence : public PipelineObserver {
 public:
  void OnInfo(const std::string& /*message*/) override {}
  void OnWarning(const std::string& message) override { warnings.push_back(message); }
  void OnProgress(const LoopProgress& /*progress*/) override {}
  std::vector<std::string> warnings;
};

class ReplayTest : public ::testing::Test {
 protected:
  // 6 places of 5 photos each; the photos of a place are edges.
  ReplayTest() {
    std::vector<SyntheticImage> images = MakePlaces(6, 5, 40, 1);
    std::ofstream truth(options_.replay_path = directory_.Path() / "truth.tsv");
    images[3].name = "with \"quotes\", and a comma";
    for (std::size_t i = 0; i < images.size(); ++i) {
      for (std::size_t j = i + 1; j < images.size() && j / 5 == i / 5; ++j) {
        truth << images[i].name << '\t' << images[j].name << "\t" << 20 + i << "\n";
      }
    }
    options_.database_path = directory_.Path() / "database.db";
    WriteSyntheticDatabase(options_.database_path, Schema::kColmap38, images);
    options_.num_threads = 1;
    options_.ranking.vectors.gmm.num_components = 4;
    options_.colmap_path = "/nowhere/colmap";
  }

  PipelineResult Run() {
    StopRequest stop;
    return RunPipeline(options_, stop, observer_);
  }

  static double ModelledSeconds(const PipelineResult& result) {
    return std::get<ReplayCost>(result.cost).modelled_seconds;
  }

  TestDirectory directory_;
  PipelineOptions options_;
  Silence observer_;
};

TEST_F(ReplayTest, FindsTheEdgesAndLeavesTheDatabaseAlone) {
  const std::string before = ReadFile(options_.database_path);
  const PipelineResult result = Run();
  EXPECT_EQ(result.matching.graph.NumEdges(), 60U);
  EXPECT_EQ(result.matching.num_components, 6U);
  EXPECT_TRUE(std::holds_alternative<ReplayCost>(result.cost));
  EXPECT_TRUE(before == ReadFile(options_.database_path));
  // Nor does it touch what a run on these photos keeps for the next one.
  EXPECT_FALSE(std::filesystem::exists(options_.database_path.string() + ".graphmatch"));
  EXPECT_THAT(observer_.warnings, IsEmpty());
}

TEST_F(ReplayTest, EndsWhenItIsAskedTo) {
  StopRequest stop;
  class Stopper : public Silence {
   public:
    explicit Stopper(StopRequest* stop) : stop_(stop) {}
    void OnProgress(const LoopProgress& progress) override {
      if (progress.all.num_tested == 7) stop_->Raise();
    }

   private:
    StopRequest* stop_;
  };
  Stopper stopper(&stop);
  const PipelineResult result = RunPipeline(options_, stop, stopper);
  EXPECT_FALSE(result.matching.finished);
  EXPECT_EQ(result.matching.graph.NumTested(), 7U);
}

TEST_F(ReplayTest, AVectorOfZerosIsNoError) {
  options_.ranking.vectors.descriptor = ImageVectorOptions::Descriptor::kFisher;
  options_.ranking.export_path = directory_.Path() / "vectors.npy";
  Run();
  NamedVectors vectors = ReadNamedVectors(options_.ranking.export_path);
  std::fill_n(vectors.rows.begin(), vectors.dim, 0.0F);
  WriteNamedVectors(options_.ranking.export_path, vectors);
  options_.ranking.vectors.vectors_path = options_.ranking.export_path;
  options_.ranking.vectors.descriptor = ImageVectorOptions::Descriptor::kFile;
  options_.ranking.export_path.clear();
  EXPECT_GE(Run().matching.graph.NumEdges(), 56U);
}

TEST_F(ReplayTest, CostsAreThoseOfTheTestedPairs) {
  options_.strategy = PipelineOptions::Strategy::kExhaustive;
  // 435 pairs of 40 x 40 products, 60 of them verified.
  const double seconds = 435 * 40 * 40 * 3.3e-10 + 60 * 0.024;
  EXPECT_NEAR(ModelledSeconds(Run()), seconds, 1e-9);
  options_.num_threads = 2;
  EXPECT_NEAR(ModelledSeconds(Run()), seconds / 2, 1e-9);
}

TEST_F(ReplayTest, TheLogHasEveryTest) {
  options_.pair_log_path = directory_.Path() / "log.csv";
  const PipelineResult result = Run();
  std::istringstream log(ReadFile(options_.pair_log_path));
  std::string line;
  std::getline(log, line);
  EXPECT_EQ(line, "test,seconds,stage,iteration,image1,image2,inliers,edge");
  std::size_t num_tests = 0;
  std::size_t num_edges = 0;
  double last_seconds = result.preprocessing_seconds.Sum();
  bool quoted = false;
  while (std::getline(log, line)) {
    ++num_tests;
    EXPECT_EQ(line.rfind(std::to_string(num_tests) + ",", 0), 0U) << line;
    const double seconds = std::stod(line.substr(line.find(',') + 1));
    EXPECT_GE(seconds, last_seconds - 1e-4);
    last_seconds = seconds;
    num_edges += line.back() == '1' ? 1 : 0;
    quoted = quoted || line.find(",\"with \"\"quotes\"\", and a comma\",") != std::string::npos;
  }
  EXPECT_EQ(num_tests, result.matching.stages.All().num_tested);
  EXPECT_EQ(num_edges, 60U);
  EXPECT_TRUE(quoted);
  options_.pair_log_path = directory_.Path() / "none" / "log.csv";
  EXPECT_THROW(Run(), FileError);
}

TEST_F(ReplayTest, TheReportSaysWhatWasFound) {
  options_.strategy = PipelineOptions::Strategy::kGraphMatch;
  const PipelineResult result = Run();
  const nlohmann::json report =
      nlohmann::json::parse(MakeJsonReport(MakeReportData(options_, result)));
  EXPECT_EQ(report["schema"], "graphmatch-report");
  EXPECT_EQ(report["version"], 1);
  EXPECT_EQ(report["strategy"], "graphmatch");
  EXPECT_EQ(report["graph"]["edges"], 60);
  EXPECT_EQ(report["images"]["total"], 30);
  EXPECT_GT(report["peak_memory_mb"], 1);
  EXPECT_LT(report["peak_memory_mb"], 10000);
  std::size_t num_tests = 0;
  int number = 0;
  for (const auto& iteration : report["iterations"]) {
    EXPECT_EQ(iteration["iteration"], number++);
    num_tests += iteration["sampling"]["tested"].get<std::size_t>() +
                 iteration["propagation"]["tested"].get<std::size_t>();
  }
  EXPECT_EQ(num_tests, result.matching.graph.NumTested());
}

TEST_F(ReplayTest, TheReportKnowsEveryImageAndPair) {
  options_.keep_details = true;
  // Another photo that shows none of the places, with a name that is not UTF-8.
  std::vector<SyntheticImage> images = MakePlaces(6, 5, 40, 1);
  images[3].name = "with \"quotes\", and a comma";
  SyntheticImage stranger = MakePlaces(1, 1, 40, 77).front();
  stranger.name =
      "Stra\xdf"
      "e.jpg";
  images.push_back(stranger);
  WriteSyntheticDatabase(options_.database_path, Schema::kColmap38, images);
  const PipelineResult result = Run();
  const nlohmann::json report =
      nlohmann::json::parse(MakeJsonReport(MakeReportData(options_, result)));
  EXPECT_EQ(report["image_names"].size(), 31U);
  EXPECT_EQ(report["image_names"][3], images[3].name);
  EXPECT_EQ(report["image_ids"][30], 31);
  EXPECT_EQ(report["connected_components"].size(), 6U);
  EXPECT_EQ(report["edge_list"].size(), 60U);
  EXPECT_EQ(report["edge_list"][0], nlohmann::json({0, 1, 20}));
  EXPECT_EQ(report["nonedge_list"].size() / 2 + 60, result.matching.graph.NumTested());
  EXPECT_EQ(report["nonedges_left_out"], 0);
  EXPECT_EQ(report["num_bridges"], 0);
  EXPECT_EQ(report["stopped_by"], nullptr);
  ASSERT_EQ(report["images_without_edge"].size(), 1U);
  const auto& alone = report["images_without_edge"][0];
  EXPECT_EQ(alone["image"], 30);
  EXPECT_EQ(alone["features"], 40);
  ASSERT_EQ(alone["candidates"].size(), 5U);
  EXPECT_LE(alone["candidates"][0]["distance"], alone["candidates"][1]["distance"]);
  const auto& last = report["discovery"].back();
  EXPECT_EQ(last["tests"], result.matching.stages.All().num_tested);
  EXPECT_EQ(last["edges"], 60);
}

TEST_F(ReplayTest, ABudgetEndsTheRun) {
  options_.budget.max_pairs = 20;
  const PipelineResult result = Run();
  EXPECT_FALSE(result.matching.finished);
  EXPECT_EQ(result.stopped_by, PipelineResult::StoppedBy::kMaxPairs);
  EXPECT_EQ(result.matching.stages.All().num_tested, 20U);
  EXPECT_GT(result.num_expected_tests_left.value_or(0), 10U);
  // The most promising first: nearly all are edges.
  EXPECT_GE(result.matching.graph.NumEdges(), 18U);

  options_.budget = {};
  options_.budget.max_minutes = 0.01;
  options_.num_threads = 1;
  // The edges alone would take 1.44 s.
  const PipelineResult timed = Run();
  EXPECT_EQ(timed.stopped_by, PipelineResult::StoppedBy::kMaxMinutes);
  EXPECT_LE(ModelledSeconds(timed), 0.6);
}

TEST_F(ReplayTest, AListIsCutAtItsEnd) {
  options_.match_list_path = directory_.Path() / "pairs.txt";
  Database database(options_.database_path, sqlite::Access::kRead, 1);
  const std::vector<ImageRecord> images = database.ReadImages();
  std::ofstream(options_.match_list_path) << images[9].name << '\t' << images[8].name << "\n"
                                          << images[0].name << '\t' << images[1].name << "\n"
                                          << images[2].name << '\t' << images[1].name << "\n";
  options_.budget.max_pairs = 1;
  options_.keep_details = true;
  const PipelineResult result = Run();
  ASSERT_TRUE(result.details.has_value());
  ASSERT_THAT(result.details->tested, SizeIs(1));
  EXPECT_EQ(result.details->tested[0].pair, ImagePair(9, 10));
}

TEST_F(ReplayTest, CandidatesAreFoundWithoutATest) {
  const auto find = [this] { return FindCandidates(options_, StopRequest(), observer_); };
  EXPECT_THAT(find, ThrowsMessage<OptionsError>(HasSubstr("leave replay_path empty")));
  options_.replay_path.clear();
  const CandidateList list = find();  // There is no COLMAP at options_.colmap_path.
  EXPECT_THAT(list.images, SizeIs(30));
  EXPECT_EQ(list.num_per_image, 10U);
  ASSERT_GE(list.pairs.size(), 30U * 10 / 2);
  EXPECT_TRUE(std::is_sorted(
      list.pairs.begin(), list.pairs.end(),
      [](const CandidatePair& a, const CandidatePair& b) { return a.distance < b.distance; }));
  EXPECT_EQ((list.pairs[0].pair.id1 - 1) / 5, (list.pairs[0].pair.id2 - 1) / 5);
  Database database(options_.database_path, sqlite::Access::kRead, 1);
  EXPECT_THAT(database.ReadTestedPairs(), IsEmpty());

  options_.strategy = PipelineOptions::Strategy::kRetrieval;
  options_.num_retrieved_images = 3;
  EXPECT_EQ(find().num_per_image, 3U);
  options_.strategy = PipelineOptions::Strategy::kExhaustive;
  EXPECT_THROW(find(), OptionsError);
}

TEST_F(ReplayTest, ExportsForOtherPrograms) {
  options_.keep_details = true;
  const std::optional<RunDetails> details = Run().details;
  ASSERT_TRUE(details.has_value());
  const std::filesystem::path path = directory_.Path() / "out.txt";
  EXPECT_TRUE(WritePairList(path, *details).any_spaces);  // All names have spaces.
  std::istringstream list(ReadFile(path));
  std::string line;
  std::size_t num_lines = 0;
  std::size_t num_tabs = 0;
  std::string first;
  while (std::getline(list, line)) {
    if (num_lines++ == 0) first = line;
    num_tabs += line.find('\t') != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(num_lines, 60U);
  EXPECT_EQ(num_tabs, 60U);
  // In the truth of this test, the later images have the more inliers.
  EXPECT_EQ(first, details->images[28].name + "\t" + details->images[29].name);

  RunDetails plain = *details;
  for (ImageRecord& image : plain.images) image.name = std::to_string(image.id) + ".jpg";
  const PairListNames plain_names = WritePairList(path, plain);
  EXPECT_FALSE(plain_names.any_spaces);
  EXPECT_EQ(plain_names.num_left_out, 0U);
  EXPECT_EQ(ReadFile(path).rfind("29.jpg 30.jpg\n", 0), 0U);

  // No list can hold such names: their pairs are left out, and what is there can be read.
  const std::string whole = ReadFile(path);
  plain.images[29].name = "30\n31 32.jpg";
  const std::size_t num_left_out = WritePairList(path, plain).num_left_out;
  const std::string rest = ReadFile(path);
  EXPECT_GT(num_left_out, 0U);
  EXPECT_EQ(std::count(rest.begin(), rest.end(), '\n') + static_cast<long>(num_left_out),
            std::count(whole.begin(), whole.end(), '\n'));
  EXPECT_THAT(rest, Not(HasSubstr("31 32")));

  WriteGraph(directory_.Path() / "graph.graphml", *details);
  const std::string graphml = ReadFile(directory_.Path() / "graph.graphml");
  EXPECT_THAT(graphml, HasSubstr("with &quot;quotes&quot;, and a comma"));
  const auto count = [](const std::string& text, const std::string& part) {
    std::size_t num = 0;
    for (std::size_t i = text.find(part); i != std::string::npos; i = text.find(part, i + 1)) ++num;
    return num;
  };
  EXPECT_EQ(count(graphml, "<node "), 30U);
  EXPECT_EQ(count(graphml, "<edge "), 60U);
  WriteGraph(directory_.Path() / "graph.dot", *details);
  const std::string dot = ReadFile(directory_.Path() / "graph.dot");
  EXPECT_THAT(dot, HasSubstr("label=\"with \\\"quotes\\\", and a comma\""));
  EXPECT_EQ(count(dot, "--"), 60U);
  EXPECT_THROW(WriteGraph(directory_.Path() / "none" / "graph.dot", *details), FileError);
  EXPECT_THROW(WritePairList(directory_.Path() / "none" / "pairs.txt", *details), FileError);
}

TEST_F(ReplayTest, RankedListsTakeThePlaceOfVectors) {
  options_.ranking.ranking_path = directory_.Path() / "lists.tsv";
  std::ofstream(options_.ranking.ranking_path) << "image_0_0.jpg\tno such image\t1\n";
  EXPECT_THROW(Run(), FileError);
  Database database(options_.database_path, sqlite::Access::kRead, 1);
  const std::vector<ImageRecord> images = database.ReadImages();
  std::ofstream(options_.ranking.ranking_path)
      << images[0].name << '\t' << images[1].name << "\t0.5\n"
      << images[7].name << '\t' << images[1].name << "\t0.25\n";
  options_.strategy = PipelineOptions::Strategy::kRetrieval;
  const PipelineResult result = Run();
  EXPECT_EQ(result.matching.graph.NumTested(), 2U);
  EXPECT_EQ(result.matching.graph.NumEdges(), 1U);
}

}  // namespace
}  // namespace colmap_graphmatch
