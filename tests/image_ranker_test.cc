#include "colmap_graphmatch/vectors/image_ranker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/encoding/visual_word_encoder.h"
#include "colmap_graphmatch/ranking/asmk_ranking.h"
#include "colmap_graphmatch/vectors/asmk_blobs.h"
#include "colmap_graphmatch/vectors/image_vectors.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

// 5 places of 4 photos each.
class AsmkRankerTest : public ::testing::Test {
 protected:
  AsmkRankerTest() {
    options_.vectors.descriptor = ImageVectorOptions::Descriptor::kAsmk;
    WriteSyntheticDatabase(path_, Schema::kColmap38, MakePlaces(5, 4, 300, 1));
  }

  // What a run ranks that sees the first images alone.
  RankedImages Run(std::size_t num_images, int num_threads = 2) {
    messages_.clear();
    Database database(path_, sqlite::Access::kRead, 1);
    std::vector<ImageRecord> images = database.ReadImages();
    images.resize(num_images);
    const std::vector<ImageFingerprint> fingerprints = database.ReadFingerprints(images);
    const auto note = [this](const std::string& text) { messages_.push_back(text); };
    const Messages messages{note, note};
    Checkpoint checkpoint(path_, {1, nullptr}, messages);
    ThreadPool threads(num_threads);
    const StopRequest stop;
    ImageRanker ranker(options_, 0, database, images, fingerprints, checkpoint, threads, stop,
                       messages);
    const VectorModel model = ranker.Learn({});
    return ranker.Rank(ranker.Encode(model));
  }

  // What the same images are ranked like, learnt and computed step by step.
  std::unique_ptr<Ranking> RankPlainly(std::size_t num_learnt_from, std::size_t num_images) {
    Database database(path_, sqlite::Access::kRead, 1);
    std::vector<ImageRecord> images = database.ReadImages();
    images.resize(num_images);
    ThreadPool threads(1);
    const VectorModel model =
        LearnVectorModel(options_.vectors, 0, database,
                         {images.begin(), images.begin() + num_learnt_from}, threads, StopRequest())
            .model;
    std::vector<VisualWords> words;
    for (const ImageRecord& image : images) {
      const Descriptors descriptors = database.ReadDescriptors(image);
      words.push_back(VisualWordEncoder(model.vocabulary)
                          .Encode(RootSift(descriptors.data.data(), descriptors.num_rows)));
    }
    return std::make_unique<AsmkRanking>(RankingOptions(), words, threads);
  }

  static void ExpectEqual(const Ranking& a, const Ranking& b) {
    ASSERT_EQ(a.NumVertices(), b.NumVertices());
    for (Vertex vertex = 0; vertex < a.NumVertices(); ++vertex) {
      EXPECT_EQ(a.NearestOf(vertex), b.NearestOf(vertex));
      for (Vertex other = 0; other < a.NumVertices(); ++other) {
        EXPECT_EQ(a.Distance(vertex, other), b.Distance(vertex, other));
      }
    }
  }

  TestDirectory directory_;
  std::filesystem::path path_ = directory_.Path() / "database.db";
  ImageRankingOptions options_;
  std::vector<std::string> messages_;
};

TEST_F(AsmkRankerTest, ThePhotosOfAPlaceAreTheNearest) {
  const RankedImages ranked = Run(20);
  for (Vertex vertex = 0; vertex < 20; ++vertex) {
    const std::vector<Vertex>& nearest = ranked.ranking->NearestOf(vertex);
    ASSERT_THAT(nearest, SizeIs(19));
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(nearest[i] / 4, vertex / 4);
  }
}

TEST_F(AsmkRankerTest, TheNextRunReadsWhatIsKeptAndExtendsIt) {
  const RankedImages first = Run(12);
  EXPECT_THAT(messages_, Contains(HasSubstr("Learnt a vocabulary")));
  ExpectEqual(*first.ranking, *RankPlainly(12, 12));
  for (const int num_threads : {1, 3}) {
    const RankedImages again = Run(12, num_threads);
    EXPECT_THAT(messages_, Not(Contains(HasSubstr("Learnt"))));
    EXPECT_THAT(messages_, Contains(HasSubstr("those of 12 images are from the last run")));
    ExpectEqual(*again.ranking, *first.ranking);
  }
  const RankedImages more = Run(20);
  EXPECT_THAT(messages_, Contains(HasSubstr("is that of the last run")));
  EXPECT_THAT(messages_, Contains(HasSubstr("those of 12 images are from the last run")));
  ExpectEqual(*more.ranking, *RankPlainly(12, 20));
}

TEST_F(AsmkRankerTest, WithMoreNewImagesThanOldTheWordsAreLearntAnew) {
  Run(8);
  const RankedImages more = Run(20);
  EXPECT_THAT(messages_, Contains(HasSubstr("Learnt a vocabulary")));
  ExpectEqual(*more.ranking, *RankPlainly(20, 20));
}

TEST_F(AsmkRankerTest, WhatIsKeptForOtherVectorsIsNotTakenForWords) {
  options_.vectors.descriptor = ImageVectorOptions::Descriptor::kFisher;
  Run(20);
  options_.vectors.descriptor = ImageVectorOptions::Descriptor::kAsmk;
  ExpectEqual(*Run(20).ranking, *RankPlainly(20, 20));
  options_.vectors.descriptor = ImageVectorOptions::Descriptor::kFisher;
  Run(20);
  EXPECT_THAT(messages_, Contains(HasSubstr("Learnt a mixture")));
}

TEST_F(AsmkRankerTest, OneImage) {
  const RankedImages ranked = Run(1);
  EXPECT_THAT(ranked.ranking->NearestOf(0), IsEmpty());
}

TEST(AsmkOptions, VisualWordsAreNoVectorsToExport) {
  ImageRankingOptions options;
  options.vectors.descriptor = ImageVectorOptions::Descriptor::kAsmk;
  options.Check();
  options.export_path = "v.npy";
  EXPECT_THROW(options.Check(), OptionsError);
}

TEST(AsmkOptions, TheKeyNamesWhatCounts) {
  ImageVectorOptions options;
  options.descriptor = ImageVectorOptions::Descriptor::kAsmk;
  // State files have it in these words.
  EXPECT_EQ(options.Key(7),
            "visual words, cells 256, words 64, training 200000, iterations 10, samples a cell "
            "200, a word 4, seed 7");
  const std::string key = options.Key(7);
  options.gmm.num_components = 1;
  options.max_num_features = 1;
  EXPECT_EQ(options.Key(7), key);
}

VisualWords Words() { return {{2, 5, 9}, {{1, 2}, {3, 4}, {5, 6}}}; }

std::optional<VisualWords> Read(const sqlite::Blob& blob, std::size_t num_words = 10) {
  return DeserializeWords(blob.data(), blob.size(), num_words);
}

TEST(AsmkBlobs, WordsAreReadAsTheyWereWritten) {
  const std::optional<VisualWords> read = Read(Serialize(Words()));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->words, Words().words);
  EXPECT_EQ(read->signs, Words().signs);
}

TEST(AsmkBlobs, WhatCannotBeWordsIsNotTakenForThem) {
  EXPECT_FALSE(Read({}).has_value());
  EXPECT_FALSE(Read(Serialize(Words()), 9).has_value());
  sqlite::Blob cut = Serialize(Words());
  cut.pop_back();
  EXPECT_FALSE(Read(cut).has_value());
  for (const std::uint32_t second : {2U, 1U, 9U}) {
    VisualWords words = Words();
    words.words[1] = second;
    EXPECT_FALSE(Read(Serialize(words)).has_value());
  }
}

TEST(AsmkBlobs, AVocabularyIsReadAsItWasWritten) {
  Vocabulary vocabulary;
  vocabulary.cells = RowMatrixXf::Random(2, 128);
  vocabulary.words = RowMatrixXf::Random(3, 128);
  vocabulary.first_words = {0, 2, 3};
  VocabularyOptions options;
  options.num_cells = 2;
  options.num_words_per_cell = 2;
  const std::optional<Vocabulary> read = DeserializeVocabulary(Serialize(vocabulary), options);
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->cells, vocabulary.cells);
  EXPECT_EQ(read->words, vocabulary.words);
  EXPECT_THAT(read->first_words, ElementsAre(0U, 2U, 3U));

  const auto is_read = [&options](const Vocabulary& other) {
    return DeserializeVocabulary(Serialize(other), options).has_value();
  };
  for (const std::vector<std::uint32_t>& first_words : std::vector<std::vector<std::uint32_t>>{
           {0, 0, 3}, {1, 2, 3}, {0, 2, 4}, {0, 3}, {0, 4, 3}}) {
    Vocabulary other = vocabulary;
    other.first_words = first_words;
    EXPECT_FALSE(is_read(other));
  }
  Vocabulary infinite = vocabulary;
  infinite.words(2, 100) = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(is_read(infinite));
  options.num_cells = 1;
  EXPECT_FALSE(is_read(vocabulary));
  options = {2, 1};
  EXPECT_FALSE(is_read(vocabulary));
  EXPECT_FALSE(DeserializeVocabulary({}, options).has_value());
  // As large as no machine's memory.
  sqlite::Blob huge(16, 0xFF);
  huge[7] = huge[15] = 0x7F;
  EXPECT_FALSE(DeserializeVocabulary(huge, VocabularyOptions()).has_value());
}

}  // namespace
}  // namespace colmap_graphmatch
