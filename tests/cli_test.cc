#include <gmock/gmock.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/cli/console.h"
#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/option_values.h"
#include "colmap_graphmatch/cli/options.h"
#include "colmap_graphmatch/cli/progress.h"
#include "colmap_graphmatch/cli/summary.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;

CommandLine Parse(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"graphmatch_matcher", "--database_path", "database.db"});
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  return ParseCommandLine(static_cast<int>(argv.size()), argv.data());
}

std::string ErrorOf(const std::vector<std::string>& arguments) {
  try {
    Parse(arguments);
  } catch (const OptionsError& error) {
    return error.what();
  }
  return "no error";
}

TEST(OptionTable, NamesBelongToOneRow) {
  CommandLine line;
  std::set<std::string> names;
  for (const OptionRow& row : MakeOptionTable(&line)) {
    EXPECT_EQ(row.names.front(), row.name);
    for (const std::string& name : row.names) EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_FALSE(row.help.empty()) << row.name;
  }
}

TEST(OptionTable, EveryRowTakesItsDefaultAndRefusesWhatItMustNotBe) {
  CommandLine line;
  for (const OptionRow& row : MakeOptionTable(&line)) {
    if (!row.default_value.empty()) {
      EXPECT_TRUE(row.read(row.default_value)) << row.name;
    }
    for (const ColmapSpelling& spelling : row.colmap) {
      if (spelling.default_value.empty()) continue;
      EXPECT_TRUE(row.read(spelling.default_value)) << row.name << " " << spelling.default_value;
    }
    for (const std::string& choice : row.choices) {
      EXPECT_TRUE(row.read(choice)) << row.name << " " << choice;
      EXPECT_NE(row.values.find(choice), std::string::npos) << row.name << " " << choice;
    }
    const bool is_checked = row.values.find("integer") != std::string::npos ||
                            row.values.find("number") != std::string::npos ||
                            row.values.find("one of") != std::string::npos ||
                            row.values == "0 or 1";
    if (!is_checked) continue;
    for (const char* text : {"", "-2", "x", "1e999", "nan", "1 2", "0x"}) {
      // COLMAP takes all numbers below 1 for all cores.
      if (row.name == "FeatureMatching.num_threads" && text == std::string("-2")) continue;
      EXPECT_FALSE(row.read(text)) << row.name << " \"" << text << "\"";
    }
  }
}

TEST(Help, ShowsTheTenThatAreUsedMostOnOneScreenAndAllOnDemand) {
  std::ostringstream common;
  PrintHelp(common);
  std::ostringstream all;
  PrintFullHelp(all);
  EXPECT_THAT(common.str(), HasSubstr("--help-all"));
  CommandLine line;
  int count = 0;
  for (const OptionRow& row : MakeOptionTable(&line)) {
    const std::string option = "\n  --" + row.name + " ";
    EXPECT_EQ(common.str().find(option) != std::string::npos, row.is_common) << row.name;
    const bool has_effect = row.use != OptionRow::Use::kUnused && row.name != "help";
    EXPECT_EQ(all.str().find(option) != std::string::npos, has_effect) << row.name;
    count += row.is_common ? 1 : 0;
  }
  EXPECT_EQ(count, 10);
}

TEST(Help, IsAskedForUnderThreeNames) {
  EXPECT_TRUE(Parse({"-h"}).help);
  EXPECT_TRUE(Parse({"--help"}).help);
  EXPECT_FALSE(Parse({"--help"}).help_all);
  EXPECT_TRUE(Parse({"--help-all"}).help_all);
}

// What shells complete.
TEST(OptionTable, TellsChoicesAndPaths) {
  CommandLine line;
  for (const OptionRow& row : MakeOptionTable(&line)) {
    const bool is_choice = row.values.find("one of") == 0 || row.values == "0 or 1";
    EXPECT_EQ(!row.choices.empty(), is_choice) << row.name;
    if (row.values.find("path") != std::string::npos) {
      EXPECT_NE(row.path, OptionRow::Path::kNone) << row.name;
      const bool is_directory = row.values.find("directory") != std::string::npos;
      EXPECT_EQ(row.path == OptionRow::Path::kDirectory, is_directory) << row.name;
    }
  }
}

TEST(OptionTable, TellsSpellingsByVersion) {
  CommandLine line;
  for (const OptionRow& row : MakeOptionTable(&line)) {
    if (row.name != "TwoViewGeometry.min_inlier_ratio") continue;
    EXPECT_EQ(row.In({3, 7}), nullptr);
    EXPECT_EQ(row.In({3, 8})->name, "SiftMatching.min_inlier_ratio");
    EXPECT_EQ(row.In({3, 12})->name, "TwoViewGeometry.min_inlier_ratio");
    EXPECT_EQ(row.In({3, 12})->default_value, "0.25");
    EXPECT_EQ(row.In({5, 0})->default_value, "0");
  }
}

TEST(Options, EverySpellingOfAnOptionMeansTheSame) {
  for (const char* group : {"SiftMatching", "TwoViewGeometry", "FeatureMatching"}) {
    const std::string prefix = std::string("--") + group;
    const CommandLine line =
        Parse({prefix + ".max_error", "3", prefix + ".max_ratio", "0.7", prefix + ".num_threads",
               "2", prefix + ".use_gpu", "false", prefix + ".min_num_inliers", "20"});
    EXPECT_EQ(line.pipeline.verification.geometry.max_error, 3);
    EXPECT_EQ(line.pipeline.verification.exact.matching.max_ratio, 0.7);
    EXPECT_EQ(line.pipeline.num_threads, 2);
    EXPECT_FALSE(line.pipeline.verification.use_gpu);
    EXPECT_EQ(line.pipeline.verification.geometry.min_num_inliers, 20);
  }
}

TEST(Options, TwoSpellingsMustAgree) {
  const std::vector<std::string> same = {"--SiftMatching.max_error", "4",
                                         "--TwoViewGeometry.max_error", "4.0"};
  EXPECT_EQ(ErrorOf(same), "no error");
  EXPECT_THAT(
      ErrorOf({"--SiftMatching.max_error", "4", "--TwoViewGeometry.max_error", "5"}),
      HasSubstr("--SiftMatching.max_error 4 and --TwoViewGeometry.max_error 5 are the same"));
  EXPECT_THAT(ErrorOf({"--random_seed", "1", "--default_random_seed", "2"}),
              HasSubstr("are the same option with different values"));
  EXPECT_THAT(
      ErrorOf({"--VocabTreeMatching.num_images", "50", "--GraphMatching.max_num_neighbors", "60"}),
      HasSubstr("are the same option with different values"));
  EXPECT_EQ(ErrorOf({"--SiftMatching.use_gpu", "0", "--FeatureMatching.use_gpu", "false"}),
            "no error");
}

TEST(Options, OfTheVocabularyTreeThatHaveAMeaningHere) {
  const CommandLine line = Parse({"--VocabTreeMatching.num_images", "50",
                                  "--VocabTreeMatching.match_list_path", "images.txt"});
  EXPECT_EQ(line.pipeline.graph.max_num_neighbors, 50);
  EXPECT_EQ(line.pipeline.image_list_path, "images.txt");
  EXPECT_THAT(line.unused_options,
              ElementsAre("--VocabTreeMatching.num_images has no effect here: it is for "
                          "--GraphMatching.strategy graphmatch."));
  EXPECT_THAT(
      Parse({"--VocabTreeMatching.num_images", "50", "--GraphMatching.strategy", "graphmatch"})
          .unused_options,
      IsEmpty());
  EXPECT_THAT(
      ErrorOf({"--VocabTreeMatching.match_list_path", "a", "--GraphMatching.match_list_path", "b"}),
      HasSubstr("give one of them"));
}

TEST(Options, TakeTheValuesThatColmapTakes) {
  for (const char* word : {"True", "FALSE", "Yes", "oFF", "1"}) {
    EXPECT_EQ(ErrorOf({"--SiftMatching.use_gpu", word}), "no error") << word;
  }
  EXPECT_EQ(ErrorOf({"--SiftMatching.use_gpu", "True", "--FeatureMatching.use_gpu", "1"}),
            "no error");
  EXPECT_EQ(Parse({"--SiftMatching.num_threads", "0"}).pipeline.num_threads, -1);
  EXPECT_EQ(Parse({"--SiftMatching.num_threads", "-7"}).pipeline.num_threads, -1);
  EXPECT_EQ(ErrorOf({"--SiftMatching.min_num_inliers", "0"}), "no error");
  // COLMAP would refuse these, shard by shard.
  EXPECT_THAT(ErrorOf({"--SiftMatching.max_error", "0"}), HasSubstr("greater than 0"));
  EXPECT_THAT(ErrorOf({"--SiftMatching.max_num_trials", "10"}), HasSubstr("at least 30"));
  EXPECT_THAT(ErrorOf({"--SiftMatching.confidence", "1.5"}), HasSubstr("from 0 to 1"));
}

TEST(Options, AnEmptyListOfImagesIsNone) {
  EXPECT_TRUE(Parse({"--VocabTreeMatching.match_list_path", ""}).pipeline.image_list_path.empty());
}

TEST(Options, WithoutMeaningAreSaidOnce) {
  const CommandLine line =
      Parse({"--VocabTreeMatching.vocab_tree_path", "tree.bin", "--VocabTreeMatching.num_checks",
             "64", "--VocabTreeMatching.num_checks", "64"});
  EXPECT_THAT(
      line.unused_options,
      ElementsAre(HasSubstr("--VocabTreeMatching.vocab_tree_path has no effect here: there is"),
                  HasSubstr("num_checks")));
}

TEST(Options, OfOtherStrategiesAndDescriptorsAreSaidToHaveNoEffect) {
  const auto unused = [](const std::string& option, const std::string& strategy,
                         const std::string& descriptor) {
    return Parse({option, "1", "--GraphMatching.strategy", strategy, "--GraphMatching.descriptor",
                  descriptor})
        .unused_options;
  };
  const std::string num_components = "--GraphMatching.num_components";
  EXPECT_THAT(unused(num_components, "graphmatch", "fisher"), IsEmpty());
  EXPECT_THAT(unused(num_components, "graphmatch", "asmk"), ElementsAre(HasSubstr("descriptor")));
  const std::string num_expansions = "--GraphMatching.num_expansions";
  EXPECT_THAT(unused(num_expansions, "briad", "asmk"), IsEmpty());
  EXPECT_THAT(unused(num_expansions, "retrieval", "asmk"), ElementsAre(HasSubstr("briad")));
  const std::string num_to_propagate = "--GraphMatching.num_to_propagate";
  EXPECT_THAT(unused(num_to_propagate, "propagation", "asmk"), IsEmpty());
  EXPECT_THAT(unused(num_to_propagate, "best_first", "asmk"), ElementsAre(HasSubstr("graphmatch")));
  EXPECT_THAT(Parse({"--GraphMatching.goal", "model"}).unused_options, IsEmpty());
  EXPECT_THAT(Parse({"--GraphMatching.goal", "model", "--GraphMatching.strategy", "exhaustive"})
                  .unused_options,
              ElementsAre(HasSubstr("no image is ranked")));
  EXPECT_THAT(
      Parse({num_components, "1", "--GraphMatching.ranking_path", "lists.tsv"}).unused_options,
      ElementsAre(HasSubstr("images are ranked by a file")));
}

TEST(Options, SeedsReachColmapToo) {
  EXPECT_THAT(Parse({}).pipeline.verification.colmap_options, IsEmpty());
  const CommandLine line = Parse({"--random_seed", "3"});
  EXPECT_EQ(line.pipeline.seed, 3U);
  EXPECT_THAT(line.pipeline.verification.colmap_options,
              ElementsAre(Pair("default_random_seed", "3")));
  EXPECT_THAT(ErrorOf({"--random_seed", "-2"}), HasSubstr("an integer of at least 0"));
  const CommandLine clock = Parse({"--default_random_seed", "-1"});
  EXPECT_NE(clock.pipeline.seed, Parse({"--default_random_seed", "-1"}).pipeline.seed);
  EXPECT_THAT(clock.pipeline.verification.colmap_options,
              ElementsAre(Pair("default_random_seed", "-1")));
}

TEST(Options, LightGlueIsColmaps) {
  EXPECT_EQ(Parse({"--FeatureMatching.type", "SIFT_BRUTEFORCE"}).pipeline.verification.matcher,
            VerificationOptions::Matcher::kAuto);
  const CommandLine line = Parse({"--FeatureMatching.type", "SIFT_LIGHTGLUE"});
  EXPECT_EQ(line.pipeline.verification.matcher, VerificationOptions::Matcher::kColmap);
  EXPECT_THAT(line.pipeline.verification.colmap_options,
              Contains(Pair("FeatureMatching.type", "SIFT_LIGHTGLUE")));
  EXPECT_THAT(
      ErrorOf({"--FeatureMatching.type", "SIFT_LIGHTGLUE", "--GraphMatching.matcher", "exact"}),
      HasSubstr("contradict"));
  EXPECT_THAT(ErrorOf({"--FeatureMatching.type", "ALIKED_BRUTEFORCE"}),
              HasSubstr("only SIFT features are matched"));
}

TEST(Options, TheNearestNameIsSuggested) {
  EXPECT_THAT(ErrorOf({"--SiftMatching.maxratio", "0.8"}),
              HasSubstr("Did you mean --SiftMatching.max_ratio?"));
  EXPECT_THAT(ErrorOf({"--VocabTreeMatching.num_imagse", "8"}),
              HasSubstr("Did you mean --VocabTreeMatching.num_images?"));
  EXPECT_THAT(ErrorOf({"--VocabTreeMatching.vocab_tree_paht", "x"}),
              HasSubstr("Did you mean --VocabTreeMatching.vocab_tree_path?"));
  EXPECT_THAT(ErrorOf({"--sIFTmATCHING.MAX_RATIO", "1"}),
              HasSubstr("Did you mean --SiftMatching.max_ratio?"));
  EXPECT_THAT(ErrorOf({"--ExhaustiveMatching.block_size", "50"}), Not(HasSubstr("Did you mean")));
  EXPECT_THAT(ErrorOf({"--GraphMatching.max_neighbors", "8"}),
              HasSubstr("Did you mean --GraphMatching.max_num_neighbors?"));
}

TEST(Options, ErrorsNameTheOptionAsItWasGiven) {
  EXPECT_EQ(ErrorOf({"--FeatureMatching.max_ratio", "zero"}),
            "--FeatureMatching.max_ratio is \"zero\"; it must be a number greater than 0.");
  EXPECT_EQ(ErrorOf({"--GraphMatching.matcher", "x"}),
            "--GraphMatching.matcher is \"x\"; it must be one of auto, colmap, exact.");
  EXPECT_THAT(ErrorOf({"--GraphMatching.strategy"}), HasSubstr("GraphMatching.strategy"));
  EXPECT_THAT(ErrorOf({"stray"}), HasSubstr("\"stray\" on the command line belongs to no option"));
}

TEST(Options, OfTheLogAreColmaps) {
  LogOptions log = Parse({}).log;
  EXPECT_EQ(log.target, LogOptions::Target::kStderrAndFile);
  EXPECT_EQ(log.path, "");
  EXPECT_EQ(log.severity, 0);
  EXPECT_EQ(log.verbosity, 0);
  EXPECT_TRUE(log.color);
  EXPECT_FALSE(log.quiet);
  log = Parse({"--log_severity", "1", "--log_level", "2", "--log_target", "stderr", "--log_color",
               "0", "--GraphMatching.quiet", "1"})
            .log;
  EXPECT_EQ(log.target, LogOptions::Target::kStderr);
  EXPECT_EQ(log.severity, 1);
  EXPECT_EQ(log.verbosity, 2);
  EXPECT_FALSE(log.color);
  EXPECT_TRUE(log.quiet);
  EXPECT_THAT(ErrorOf({"--log_severity", "4"}), HasSubstr("an integer from 0 to 3"));
  EXPECT_THAT(ErrorOf({"--log_target", "printer"}), HasSubstr("one of file, stderr"));
}

TEST(Options, TheLogGoesToAFileThatIsNamed) {
  EXPECT_EQ(Parse({"--log_target", "file", "--log_path", "a.log"}).log.target,
            LogOptions::Target::kFile);
  EXPECT_THAT(ErrorOf({"--log_target", "file"}), HasSubstr("needs --log_path"));
  // What COLMAP 3.8 and COLMAP 4 write into their project files must not silence it.
  EXPECT_EQ(Parse({"--log_to_stderr", "false"}).log.target, LogOptions::Target::kStderrAndFile);
  EXPECT_EQ(Parse({"--log_target", "stderr_and_file", "--log_path", ""}).log.path, "");
  EXPECT_EQ(Parse({"--log_to_stderr", "0", "--log_path", "a.log"}).log.target,
            LogOptions::Target::kFile);
}

TEST(RecentRate, IsThatOfTheLastHalfMinuteOrSo) {
  RecentRate rate;
  EXPECT_EQ(rate.At(0), 0);
  // What ends right after the beginning was begun before it.
  rate.Update(100, 64);
  rate.Update(100.4, 128);
  EXPECT_EQ(rate.At(101), 0);
  for (int i = 1; i <= 200; ++i) rate.Update(100.4 + i, 128 + 50 * static_cast<std::size_t>(i));
  EXPECT_NEAR(rate.At(300.4), 50, 1e-6);
  for (int i = 1; i <= 30; ++i) rate.Update(300.4 + i, 10128 + 10 * static_cast<std::size_t>(i));
  // 1 / e of what is older than the window.
  EXPECT_NEAR(rate.At(330.4), 10 + 40 * std::exp(-1), 0.1);
  for (int i = 31; i <= 300; ++i) rate.Update(300.4 + i, 10128 + 10 * static_cast<std::size_t>(i));
  EXPECT_NEAR(rate.At(600.4), 10, 0.01);
  // Nothing comes any more.
  EXPECT_NEAR(rate.At(630.4), 10 * std::exp(-1), 0.1);
}

// Feeds the progress of batches of 100 pairs that take some seconds each.
class TimeLeftTest : public ::testing::Test {
 protected:
  void Test(LoopStage stage, int iteration, double seconds) {
    if (!begun_) left_.Update(0, progress_);
    begun_ = true;
    progress_.stage = stage;
    progress_.iteration = iteration;
    for (int i = 0; i < 100; ++i) {
      ++progress_.all.num_tested;
      left_.Update(seconds_ += seconds / 100, progress_);
    }
  }

  double Left(std::size_t num_samples, std::size_t num_others) {
    progress_.expected_remaining_samples = num_samples;
    progress_.expected_remaining_tests = num_samples + num_others;
    left_.Update(seconds_, progress_);
    return left_.At(seconds_);
  }

  TimeLeft left_;
  LoopProgress progress_;
  double seconds_ = 0;
  bool begun_ = false;
};

TEST_F(TimeLeftTest, IsNotKnownBeforeTheFirstTest) { EXPECT_LT(left_.At(0), 0); }

TEST_F(TimeLeftTest, AsLongAsThereIsOneStageItsRateIsThatOfAll) {
  Test(LoopStage::kSampling, 0, 10);
  EXPECT_NEAR(Left(200, 100), 30, 1e-6);
}

TEST_F(TimeLeftTest, SamplesGetCheaperAsTheyDidLast) {
  Test(LoopStage::kSampling, 0, 10);
  Test(LoopStage::kPropagation, 0, 20);
  Test(LoopStage::kSampling, 1, 8);
  Test(LoopStage::kPropagation, 1, 20);
  // Three iterations of 100 samples at 0.8, 0.64 and 0.512 of 8 seconds.
  EXPECT_NEAR(Left(300, 100), 8 * (0.8 + 0.64 + 0.512) + 20, 1e-6);
  // If they get dearer, that is not taken to go on, and nothing is more than halved.
  Test(LoopStage::kSampling, 2, 16);
  EXPECT_NEAR(Left(300, 0), 48, 1e-6);
  Test(LoopStage::kSampling, 3, 1);
  EXPECT_NEAR(Left(100, 0), 0.5, 1e-6);
}

TEST_F(TimeLeftTest, WhatDoesNotComeTakesLonger) {
  Test(LoopStage::kPropagation, 0, 10);
  const double now = Left(0, 100);
  EXPECT_GT(left_.At(seconds_ + 30), 2 * now);
}

ProgressView MakeView(std::size_t scale) {
  ProgressView view;
  view.loop.stage = LoopStage::kPropagation;
  view.loop.iteration = 2;
  view.loop.all.num_tested = 3 * scale;
  view.loop.all.num_edges = scale;
  view.loop.num_edges = scale + 7;
  view.loop.num_components = scale / 5;
  view.loop.largest_component = scale / 3;
  view.loop.num_isolated = scale / 4;
  view.loop.expected_remaining_tests = scale;
  view.num_tested_now = 4;
  view.num_edges_now = 1;
  view.rate = static_cast<double>(scale) / 100;
  view.seconds = static_cast<double>(scale);
  view.seconds_left = scale > 0 ? 100 : -1;
  return view;
}

TEST(Block, AsItIsAtEightyColumns) {
  EXPECT_THAT(FormatBlock(MakeView(1200), 79),
              ElementsAre("propagation 3 [===========================>         ] 75 %   about "
                          "1.7 min left",
                          "3,600 pairs tested   12.0 pairs/s   1,207 edges",
                          "efficiency 0.25 now, 0.33 overall   240 components   largest 400 images",
                          "300 images alone"));
}

TEST(Block, FitsEveryWidthWithEveryField) {
  for (const std::size_t scale : {0, 1, 1200, 20000000}) {
    for (std::size_t width = 59; width <= 200; ++width) {
      const std::vector<std::string> lines = FormatBlock(MakeView(scale), width);
      EXPECT_GE(lines.size(), 2U) << width;
      EXPECT_LE(lines.size(), scale > 2000000 ? 5U : 4U) << width;
      std::string all;
      for (const std::string& line : lines) {
        EXPECT_LE(line.size(), width) << line;
        all += line + "   ";
      }
      for (const char* field : {"propagation 3 [", " %   ", " left", " pairs tested   ", " pairs/s",
                                " edges   ", "efficiency 0.25 now, ", " overall   ",
                                " components   largest ", " images   ", " images alone   "}) {
        if (scale == 0 && field == std::string(" left")) continue;
        EXPECT_THAT(all, HasSubstr(field)) << width;
      }
    }
  }
}

TEST(Block, SaysWhatIsNotKnownYet) {
  ProgressView view;
  view.loop.stage = LoopStage::kListed;
  const std::vector<std::string> lines = FormatBlock(view, 200);
  EXPECT_THAT(lines[0], HasSubstr("matching [>"));
  EXPECT_THAT(lines[0], HasSubstr("time left: not known yet"));
  EXPECT_THAT(lines[1], HasSubstr("- pairs/s"));
  EXPECT_THAT(lines[1], HasSubstr("efficiency - now, - overall"));
}

TEST(Block, ALogHasItInOneLine) {
  EXPECT_EQ(FormatProgress(MakeView(1200)),
            "propagation 3: 3600 pairs tested (75 %), 12.0 pairs/s, about 1.7 min left; 1207 "
            "edges, efficiency 0.25 now, 0.33 overall; 240 components, largest 400 images, 300 "
            "images alone");
}

TEST(Console, NamesGiveNoOrdersToTheTerminal) {
  EXPECT_EQ(WithoutControlCharacters("a \"\x1b[2J\x07\x7f\r\" b\n\tc \xc3\xa9"),
            "a \"?[2J???\" b\n\tc \xc3\xa9");
  EXPECT_EQ(WithoutControlCharacters("\xc2\x9b"
                                     "2J \xc2\xa9 \xc2"),
            "?2J \xc2\xa9 \xc2");
}

TEST(OptionValues, WordsOfAnEnumAreListedInOrder) {
  PipelineOptions::Strategy strategy = PipelineOptions::Strategy::kRetrieval;
  const Value value = OneOf(&strategy, kStrategyWords);
  EXPECT_EQ(value.values,
            "one of best_first, briad, exhaustive, graphmatch, propagation, retrieval, sampling");
  EXPECT_EQ(value.default_value, "retrieval");
  EXPECT_TRUE(value.read("briad"));
  EXPECT_EQ(strategy, PipelineOptions::Strategy::kBriad);
  EXPECT_FALSE(value.read("Briad"));
  EXPECT_EQ(strategy, PipelineOptions::Strategy::kBriad);
}

TEST(OptionValues, ARefusedValueChangesNothing) {
  int number = 5;
  const Value bounded = IntOf(&number, 0, 9);
  EXPECT_EQ(bounded.values, "an integer from 0 to 9");
  EXPECT_FALSE(bounded.read("10"));
  EXPECT_EQ(number, 5);
  EXPECT_TRUE(bounded.read("9"));
  EXPECT_EQ(number, 9);
  std::uint64_t seed = 7;
  bool from_clock = false;
  const Value seed_value = SeedOf(&seed, &from_clock);
  EXPECT_TRUE(seed_value.read("-1"));
  EXPECT_TRUE(from_clock);
  EXPECT_FALSE(seed_value.read("-2"));
  EXPECT_FALSE(from_clock);
  EXPECT_EQ(seed, 7U);
}

// A run over 5 images that was stopped by its budget.
PipelineResult MakeResult() {
  PipelineResult result;
  result.num_images = 5;
  result.num_images_without_features = 1;
  result.matching.num_isolated = 1;
  result.matching.num_components = 1;
  result.matching.largest_component = 3;
  result.matching.finished = false;
  result.stopped_by = PipelineResult::StoppedBy::kMaxPairs;
  result.num_expected_tests_left = 2;
  result.preprocessing_seconds = {1, 2, 3};
  result.matching_seconds = 90;
  result.total_seconds = 96.5;
  return result;
}

TEST(Summary, OfARunThatABudgetEnded) {
  PipelineOptions options;
  options.budget.max_pairs = 4;
  EXPECT_EQ(FormatSummary(options, MakeResult()),
            "\n"
            "Images             5 (1 without features)\n"
            "Pairs tested       0 of 6 possible (0.00 %)\n"
            "  all                  0 tested         0 edges   efficiency -            0.0 s\n"
            "Matching graph     0 edges, 1 components, the largest of 3 images\n"
            "Without an edge    2 images\n"
            "Stopped            after max_pairs = 4; about 2 more tests were to come\n"
            "Time               96.5 s (vocabulary 1.0 s, visual words 2.0 s, ranking 3.0 s, "
            "matching 90.0 s)\n");
}

TEST(Summary, OfListedPairsHasNoStages) {
  PipelineResult result = MakeResult();
  PipelineOptions options;
  options.strategy = PipelineOptions::Strategy::kExhaustive;
  result.stopped_by = PipelineResult::StoppedBy::kNothing;
  const std::string text = FormatSummary(options, result);
  EXPECT_THAT(text, Not(HasSubstr("listed")));
  EXPECT_THAT(text, Not(HasSubstr("ranking")));
  EXPECT_THAT(text, HasSubstr("\nTime               96.5 s\n"));
}

class ProjectTest : public ::testing::Test {
 protected:
  std::vector<std::string> Project(const std::string& text) {
    const std::filesystem::path path = directory_.Path() / "project.ini";
    std::ofstream(path) << text;
    return {"--project_path", path.string()};
  }

  TestDirectory directory_;
};

TEST_F(ProjectTest, TheCommandLineGoesBeforeInAnySpelling) {
  std::vector<std::string> arguments = Project(
      "[SiftMatching]\nmax_error=3\nmax_ratio=0.7\n[VocabTreeMatching]\nnum_images=30\n"
      "vocab_tree_path=\n[Mapper]\nmin_num_matches=x\n");
  CommandLine line = Parse(arguments);
  EXPECT_EQ(line.pipeline.verification.geometry.max_error, 3);
  EXPECT_EQ(line.pipeline.graph.max_num_neighbors, 30);
  arguments.insert(arguments.end(),
                   {"--TwoViewGeometry.max_error", "5", "--GraphMatching.max_num_neighbors", "40"});
  line = Parse(arguments);
  EXPECT_EQ(line.pipeline.verification.geometry.max_error, 5);
  EXPECT_EQ(line.pipeline.graph.max_num_neighbors, 40);
  EXPECT_EQ(line.pipeline.verification.exact.matching.max_ratio, 0.7);
}

TEST_F(ProjectTest, DefaultsWithoutMeaningAreNotMentioned) {
  EXPECT_THAT(Parse(Project("[VocabTreeMatching]\nnum_checks=64\nnum_nearest_neighbors=5\n"))
                  .unused_options,
              IsEmpty());
  EXPECT_THAT(Parse(Project("[VocabTreeMatching]\nnum_checks=65\n")).unused_options,
              ElementsAre(HasSubstr("num_checks")));
  EXPECT_THAT(Parse(Project("[VocabTreeMatching]\nnum_images=100\n")).unused_options, IsEmpty());
  EXPECT_THAT(Parse(Project("[VocabTreeMatching]\nnum_images=50\n")).unused_options,
              ElementsAre(HasSubstr("--VocabTreeMatching.num_images has no effect here")));
}

TEST_F(ProjectTest, UnknownNamesInGroupsOfMatchingAreMentioned) {
  const std::string text = "[SiftMatching]\nmax_ratioo=0.5\n[Mapper]\nno_such_option=1\n";
  EXPECT_THAT(Parse(Project(text)).warnings,
              ElementsAre(HasSubstr("unknown option SiftMatching.max_ratioo. Did you mean "
                                    "--SiftMatching.max_ratio?")));
}

TEST_F(ProjectTest, ErrorsNameTheFile) {
  EXPECT_THAT(ErrorOf(Project("[SiftMatching]\nmax_ratio=x\n")), HasSubstr("project.ini is \"x\""));
  EXPECT_THAT(ErrorOf(Project("[SiftMatching\n")), HasSubstr("is no ini file"));
  EXPECT_THAT(
      ErrorOf(Project("[GraphMatching]\nstrateg=exhaustive\n")),
      HasSubstr("unknown option GraphMatching.strateg. Did you mean --GraphMatching.strategy?"));
  EXPECT_THAT(ErrorOf(Project("[SiftMatching]\nmax_error=1\n[TwoViewGeometry]\nmax_error=2\n")),
              HasSubstr("are the same option with different values"));
  EXPECT_THAT(ErrorOf({"--project_path", directory_.Path().string()}), HasSubstr("Cannot read"));
}

}  // namespace
}  // namespace colmap_graphmatch
