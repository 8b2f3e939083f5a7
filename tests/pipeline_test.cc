#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/crc.hpp>
#include <chrono>
#include <fstream>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/colmap_graphmatch.h"
#include "colmap_graphmatch/files/pair_list.h"
#include "colmap_graphmatch/pipeline/strategy.h"
#include "colmap_graphmatch/vectors/checkpoint.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

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

TEST(PipelineOptions, OptionsThatWouldHaveNoEffect) {
  const auto is_refused = [](const auto& set) {
    PipelineOptions options;
    set(options);
    try {
      options.Check();
    } catch (const OptionsError&) {
      return true;
    }
    return false;
  };
  using Strategy = PipelineOptions::Strategy;
  using Descriptor = ImageVectorOptions::Descriptor;
  const auto exports = [](PipelineOptions& o, const char* path) {
    o.ranking.vectors.descriptor = Descriptor::kFisher;
    o.ranking.export_path = path;
  };
  EXPECT_FALSE(is_refused([&](PipelineOptions& o) { exports(o, "v.npy"); }));
  EXPECT_TRUE(is_refused([&](PipelineOptions& o) { exports(o, "v.txt"); }));
  EXPECT_TRUE(is_refused([](PipelineOptions& o) { o.ranking.export_path = "v.npy"; }));
  EXPECT_TRUE(is_refused([&](PipelineOptions& o) {
    exports(o, "v.npy");
    o.strategy = Strategy::kExhaustive;
  }));
  EXPECT_TRUE(is_refused([](PipelineOptions& o) {
    o.ranking.ranking_path = "lists.tsv";
    o.match_list_path = "pairs.txt";
  }));
  EXPECT_TRUE(is_refused([](PipelineOptions& o) {
    o.ranking.ranking_path = "lists.tsv";
    o.ranking.vectors.descriptor = ImageVectorOptions::Descriptor::kVlad;
  }));
}

TEST(ImageVectorOptions, TheSeedAndEveryFieldButThePathsChangeTheKey) {
  ImageVectorOptions fisher;
  fisher.descriptor = ImageVectorOptions::Descriptor::kFisher;
  std::set<std::string> keys = {fisher.Key(0), fisher.Key(1)};
  EXPECT_EQ(keys.size(), 2U);
  const std::vector<void (*)(ImageVectorOptions*)> changes = {
      [](ImageVectorOptions* o) { o->descriptor = ImageVectorOptions::Descriptor::kVlad; },
      [](ImageVectorOptions* o) { o->pca_dim = 1; },
      [](ImageVectorOptions* o) { o->gmm.num_components = 1; },
      [](ImageVectorOptions* o) { o->num_training_descriptors = 1; },
      [](ImageVectorOptions* o) { o->max_num_features = 1; }};
  for (const auto& change : changes) {
    ImageVectorOptions options = fisher;
    change(&options);
    EXPECT_TRUE(keys.insert(options.Key(0)).second) << options.Key(0);
    EXPECT_EQ(options.Key(0), ImageVectorOptions(options).Key(0));
  }
  ImageVectorOptions elsewhere;
  elsewhere.image_path = "photos";
  elsewhere.vectors_path = "vectors.npy";
  EXPECT_EQ(elsewhere.Key(0), ImageVectorOptions().Key(0));
  // State files have it in these words.
  EXPECT_EQ(fisher.Key(7),
            "descriptor 0, PCA 32, components 64, tolerance 0x1.4f8b588e368f1p-17, iterations 100, "
            "variance floor 0x1.a36e2eb1c432dp-14, seed 7, training 100000, features 1000, seed 7");
}

TEST(Strategies, DrawTheirOwnNumberOfImages) {
  using Strategy = PipelineOptions::Strategy;
  const auto draws = [](Strategy strategy, int num_retrieved_images) {
    PipelineOptions options;
    options.strategy = strategy;
    options.num_retrieved_images = num_retrieved_images;
    return DrawsPerImage(options, 1000);
  };
  for (const Strategy loop : {Strategy::kGraphMatch, Strategy::kSampling, Strategy::kPropagation}) {
    EXPECT_EQ(draws(loop, 0), 17);
    EXPECT_EQ(draws(loop, 7), 17);
  }
  EXPECT_EQ(draws(Strategy::kRetrieval, 0), 120);
  EXPECT_EQ(draws(Strategy::kRetrieval, 7), 7);
  EXPECT_EQ(draws(Strategy::kBriad, 0), 40);
  EXPECT_EQ(draws(Strategy::kBriad, 7), 7);
  EXPECT_EQ(draws(Strategy::kBestFirst, 0), 10);
  EXPECT_THROW(draws(Strategy::kExhaustive, 0), std::logic_error);
}

// With other words the seeds of earlier runs would no longer be found.
TEST(LoopKey, StateFilesHaveItInTheseWords) {
  PipelineOptions loop;
  loop.strategy = PipelineOptions::Strategy::kGraphMatch;
  EXPECT_EQ(LoopKey(loop, PairRestrictions()),
            "loop: iterations 10, neighbors 120, propagated 4, tests 0, failed 0, seeking 0 0, "
            "frames 0 0, inliers 15");
  PipelineOptions best_first;
  best_first.strategy = PipelineOptions::Strategy::kBestFirst;
  EXPECT_EQ(LoopKey(best_first, PairRestrictions()),
            "best first: probability 0x1.47ae147ae147bp-7, seeking 0 0, frames 0 0, inliers 15");
  best_first.best_first.goal = BestFirstOptions::Goal::kModel;
  EXPECT_EQ(LoopKey(best_first, PairRestrictions()),
            "best first: probability 0x1.47ae147ae147bp-7, seeking 0 0, frames 0 0, goal 1, "
            "inliers 15");
}

TEST(Checkpoint, OneOfNothingKeepsNothing) {
  Checkpoint state;
  state.Select(ImageVectorOptions(), 0, {{1, 11}}, "");
  state.KeepModel(VectorModel());
  const float entry = 1;
  state.KeepVectors({0}, 1, &entry);
  state.KeepSeeds("key", {ImagePair(1, 2)});
  float read = 0;
  EXPECT_FALSE(state.ReadModel().has_value());
  EXPECT_EQ(state.ReadVectors(1, &read), std::vector<bool>{false});
  EXPECT_TRUE(state.ReadSeeds("key").empty());
  EXPECT_TRUE(state.FindChanged().empty());
}

class CheckpointTest : public ::testing::Test {
 protected:
  Checkpoint Open(double lock_timeout = 1) {
    const auto warn = [this](const std::string& text) { warnings_.push_back(text); };
    Checkpoint state(database_, {lock_timeout, &stop_}, {warn, warn});
    ImageVectorOptions options;
    options.descriptor = ImageVectorOptions::Descriptor::kFisher;
    options.gmm.num_components = 2;
    options.pca_dim = pca_dim_;
    state.Select(options, 0, {{1, 11}, {2, 22}, {3, 33}}, "");
    return state;
  }

  static GaussianMixture Mixture(Eigen::Index num_components, Eigen::Index dim) {
    GaussianMixture mixture;
    mixture.weights = Eigen::VectorXd::Constant(num_components, 0.5);
    mixture.means = RowMatrixXd::Constant(num_components, dim, 0.1);
    mixture.variances = RowMatrixXd::Constant(num_components, dim, 0.2);
    return mixture;
  }

  static VectorModel Model(const GaussianMixture& mixture) { return {Pca(), mixture, {}}; }

  // What the next run finds of a mixture that was kept with two vectors of three.
  bool IsFound(const GaussianMixture& mixture) {
    {
      Checkpoint state = Open();
      state.KeepModel(Model(mixture));
      state.KeepVectors({0, 2}, 4, std::vector<float>(8, 1).data());
    }
    return Open().ReadModel().has_value();
  }

  TestDirectory directory_;
  std::filesystem::path database_ = directory_.Path() / "database.db";
  StopRequest stop_;
  std::vector<std::string> warnings_;
  int pca_dim_ = 0;
};

TEST_F(CheckpointTest, APcaIsKeptWithTheMixture) {
  pca_dim_ = 3;
  VectorModel model = Model(Mixture(2, 3));
  EXPECT_FALSE(IsFound(model.mixture));  // Without the PCA it is of no use.
  model.pca.mean = Eigen::VectorXd::Constant(kDescriptorDim, 0.25);
  model.pca.basis = RowMatrixXd::Identity(3, kDescriptorDim);
  {
    Checkpoint state = Open();
    state.KeepModel(model);
    state.KeepVectors({0, 2}, 4, std::vector<float>(8, 1).data());
  }
  const std::optional<VectorModel> found = Open().ReadModel();
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->pca.mean, model.pca.mean);
  EXPECT_EQ(found->pca.basis, model.pca.basis);
  EXPECT_EQ(found->mixture.variances, model.mixture.variances);
  pca_dim_ = 4;
  EXPECT_FALSE(Open().ReadModel().has_value());
}

TEST_F(CheckpointTest, AMixtureIsKeptWhileHalfOfTheImagesHaveAVector) {
  const GaussianMixture mixture = Mixture(2, kDescriptorDim);
  EXPECT_TRUE(IsFound(mixture));
  {
    Checkpoint state = Open();
    EXPECT_EQ(state.ReadModel()->mixture.means, mixture.means);
    std::vector<float> vectors(12);
    EXPECT_THAT(state.ReadVectors(4, vectors.data()), ElementsAre(true, false, true));
    state.KeepModel(Model(mixture));
    state.KeepVectors({1}, 4, vectors.data());
  }
  EXPECT_FALSE(Open().ReadModel().has_value());
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(CheckpointTest, WhatCannotBeAMixtureIsNotTakenForOne) {
  EXPECT_TRUE(IsFound(Mixture(1, kDescriptorDim)));
  EXPECT_FALSE(IsFound(Mixture(3, kDescriptorDim)));
  EXPECT_FALSE(IsFound(Mixture(2, kDescriptorDim / 2)));
  for (const double value : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    GaussianMixture mixture = Mixture(2, kDescriptorDim);
    mixture.variances(1, 5) = value;
    EXPECT_FALSE(IsFound(mixture)) << value;
  }
  // As large as no machine's memory.
  const std::int64_t shape[] = {std::int64_t{1} << 20, std::int64_t{1} << 20, 0};
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(shape);
  sqlite::Connection connection(StateFile::PathFor(database_), sqlite::Access::kReadWrite, 1);
  sqlite::Statement update(connection, "UPDATE mixture SET data = ?1, checksum = ?2");
  boost::crc_32_type crc;
  crc.process_bytes(shape, sizeof(shape));
  const sqlite::Blob blob(bytes, bytes + sizeof(shape));
  update.Bind(1, blob).Bind(2, std::int64_t{crc.checksum()}).Run();
  EXPECT_FALSE(Open().ReadModel().has_value());
}

TEST_F(CheckpointTest, SeedsBelongToALoop) {
  { Open().KeepSeeds("loop", {ImagePair(1, 2)}); }
  EXPECT_THAT(Open().ReadSeeds("loop"), ElementsAre(ImagePair(1, 2)));
  EXPECT_THAT(Open().ReadSeeds("another loop"), IsEmpty());
}

TEST_F(CheckpointTest, WaitingEndsWhenAskedTo) {
  const Checkpoint first = Open();
  EXPECT_THROW(Open(0.3), DatabaseLockedError);
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("waiting for it")));
  std::thread stopper([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    stop_.Raise();
  });
  EXPECT_THROW(Open(1000), StoppedError);
  stopper.join();
}

}  // namespace
}  // namespace colmap_graphmatch
