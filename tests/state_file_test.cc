#include "colmap_graphmatch/database/state_file.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/database.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::size_t kDim = 5;

class StateFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    database_path_ = directory_.Path() / "a database.db";
    path_ = StateFile::PathFor(database_path_);
    for (ImageId id = 1; id <= 3; ++id) images_.push_back({id, 1000 + id});
    vectors_.resize(images_.size() * kDim);
    std::iota(vectors_.begin(), vectors_.end(), 0.5F);
  }

  void WriteAll() {
    StateFile state(database_path_, 1);
    state.WriteMixture("key", {1, 2, 3});
    state.WriteVectors(images_, [this](std::size_t i) {
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(vectors_.data() + i * kDim);
      return sqlite::Blob(bytes, bytes + kDim * sizeof(float));
    });
    state.WriteSeeds("run", {ImagePair(1, 2), ImagePair(2, 3)});
  }

  // Those of `dim` entries, into vectors.
  std::vector<bool> ReadVectors(StateFile& state, std::size_t dim,
                                std::vector<float>* vectors) const {
    return state.ReadVectors(images_,
                             [&](std::size_t i, const std::uint8_t* data, std::size_t size) {
                               if (size != dim * sizeof(float)) return false;
                               std::memcpy(vectors->data() + i * dim, data, size);
                               return true;
                             });
  }

  void Execute(const std::string& sql) const {
    sqlite::Connection(path_, sqlite::Access::kReadWrite, 1).Execute(sql);
  }

  // What is found in the file by a new run.
  struct Found {
    bool mixture = false;
    std::vector<bool> vectors;
    std::size_t num_seeds = 0;
  };
  Found ReadAll() const {
    StateFile state(database_path_, 1);
    Found found;
    found.mixture = state.ReadMixture("key").has_value();
    std::vector<float> vectors(vectors_.size());
    found.vectors = ReadVectors(state, kDim, &vectors);
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      EXPECT_EQ(vectors[i], found.vectors[i / kDim] ? vectors_[i] : 0);
    }
    found.num_seeds = state.ReadSeeds("run").value_or(std::vector<ImagePair>()).size();
    return found;
  }

  TestDirectory directory_;
  std::filesystem::path database_path_;
  std::filesystem::path path_;
  std::vector<ImageFingerprint> images_;
  std::vector<float> vectors_;
};

TEST_F(StateFileTest, KeepsWhatItIsGiven) {
  WriteAll();
  const Found found = ReadAll();
  EXPECT_TRUE(found.mixture);
  EXPECT_THAT(found.vectors, ElementsAre(true, true, true));
  StateFile state(database_path_, 1);
  EXPECT_EQ(*state.ReadMixture("key"), (sqlite::Blob{1, 2, 3}));
  EXPECT_THAT(*state.ReadSeeds("run"), ElementsAre(ImagePair(1, 2), ImagePair(2, 3)));
  state.WriteSeeds("run", {});
  EXPECT_THAT(*state.ReadSeeds("run"), IsEmpty());
  EXPECT_EQ(state.CountVectors(images_), 3U);
}

TEST_F(StateFileTest, GivesNothingForOtherKeysOrFeatures) {
  WriteAll();
  StateFile state(database_path_, 1);
  EXPECT_FALSE(state.ReadMixture("another").has_value());
  EXPECT_FALSE(state.ReadSeeds("another").has_value());
  images_[1].features += 1;
  EXPECT_EQ(state.CountVectors(images_), 2U);
  std::vector<float> vectors(vectors_.size());
  EXPECT_THAT(ReadVectors(state, kDim, &vectors), ElementsAre(true, false, true));
  EXPECT_THAT(ReadVectors(state, kDim - 1, &vectors), ElementsAre(false, false, false));
}

TEST_F(StateFileTest, ANewMixtureDropsTheVectorsOfTheOldOne) {
  WriteAll();
  { StateFile(database_path_, 1).WriteMixture("key", {4}); }
  EXPECT_THAT(ReadAll().vectors, ElementsAre(false, false, false));
}

TEST_F(StateFileTest, DamagedRowsAreAsIfTheyWereNotThere) {
  WriteAll();
  Execute("UPDATE vectors SET data = zeroblob(length(data)) WHERE image_id = 2");
  Execute("UPDATE mixture SET data = x'010204'");
  Execute("DELETE FROM seeds WHERE pair_id = (SELECT max(pair_id) FROM seeds)");
  const Found found = ReadAll();
  EXPECT_FALSE(found.mixture);
  EXPECT_THAT(found.vectors, ElementsAre(true, false, true));
  EXPECT_EQ(found.num_seeds, 0U);
}

TEST_F(StateFileTest, DropsVectorsOfImagesThatAreGone) {
  WriteAll();
  StateFile state(database_path_, 1);
  state.DropVectorsExcept({images_[0], images_[2], {99, 1}});
  std::vector<float> vectors(vectors_.size());
  EXPECT_THAT(ReadVectors(state, kDim, &vectors), ElementsAre(true, false, true));
}

TEST_F(StateFileTest, MadeAnewItStaysTheSameFileForThoseThatWait) {
  const auto inode = [&] {
    struct stat status = {};
    EXPECT_EQ(::stat(path_.c_str(), &status), 0);
    return status.st_ino;
  };
  for (const bool damaged : {false, true}) {
    WriteAll();
    const ino_t before = inode();
    if (damaged) {
      std::fstream file(path_);
      file.seekp(100);
      file << std::string(500, 'x');
    } else {
      Execute("PRAGMA user_version = 999");
    }
    const StateFile state(database_path_, 1);
    EXPECT_EQ(inode(), before);
    EXPECT_THROW(StateFile(database_path_, 0), DatabaseLockedError);
  }
}

TEST_F(StateFileTest, OfAnotherVersionOrWithoutItsTablesItIsMadeAnew) {
  for (const char* damage : {"PRAGMA user_version = 999", "DROP TABLE vectors"}) {
    WriteAll();
    Execute(damage);
    EXPECT_EQ(ReadAll().num_seeds, 0U) << damage;
    WriteAll();
    EXPECT_EQ(ReadAll().num_seeds, 2U) << damage;
  }
}

TEST_F(StateFileTest, WithDamagedPagesItIsMadeAnewOrReadAsFarAsItIsWhole) {
  WriteAll();
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(path_));
  std::string whole(static_cast<std::size_t>(size), '\0');
  std::ifstream(path_, std::ios::binary).read(whole.data(), size);
  for (std::streamoff offset = 100; offset < size; offset += 997) {
    std::ofstream file(path_, std::ios::binary);
    file.write(whole.data(), size);
    file.seekp(offset);
    file.write("\xFF\xFF\xFF\xFF", 4);
    file.close();
    try {
      ReadAll();
    } catch (const sqlite::DamagedFileError&) {
      StateFile(database_path_, 1).MakeAnew();
    }
    WriteAll();
    EXPECT_THAT(ReadAll().vectors, ElementsAre(true, true, true));
  }
}

TEST_F(StateFileTest, WhatIsNotItsOwnIsLeftAlone) {
  std::ofstream(path_) << "a letter to my grandmother, longer than the header of a database: "
                       << std::string(200, 'x');
  EXPECT_THROW(StateFile(database_path_, 1), DatabaseError);
  std::filesystem::remove(path_);
  WriteSyntheticDatabase(path_, Schema::kColmap38, MakePlaces(1, 2, 5, 1));
  try {
    const StateFile state(database_path_, 1);
    FAIL() << "another database was taken";
  } catch (const DatabaseError& error) {
    EXPECT_THAT(error.what(), HasSubstr("is in the way"));
  }
  EXPECT_EQ(Database(path_, sqlite::Access::kRead, 1).ReadImages().size(), 2U);
}

TEST_F(StateFileTest, OnlyOneRunHasIt) {
  const StateFile state(database_path_, 1);
  try {
    const StateFile second(database_path_, 0.05);
    FAIL() << "two runs at once";
  } catch (const DatabaseLockedError& error) {
    EXPECT_THAT(error.what(), HasSubstr("Another graphmatch_matcher works on this database"));
  }
}

TEST_F(StateFileTest, WhoMayNotReadTheDatabaseMayNotReadItEither) {
  using std::filesystem::perms;
  const auto rights = [&] { return std::filesystem::status(path_).permissions(); };
  std::ofstream(database_path_) << "a database";
  std::filesystem::permissions(database_path_, perms::owner_read | perms::owner_write);
  { const StateFile made(database_path_, 1); }
  EXPECT_EQ(rights(), perms::owner_read | perms::owner_write);
  std::filesystem::permissions(path_, perms(0644));
  { const StateFile found(database_path_, 1); }
  EXPECT_EQ(rights(), perms::owner_read | perms::owner_write);
  std::filesystem::permissions(database_path_, perms(0664));
  std::filesystem::remove(path_);
  { const StateFile shared(database_path_, 1); }
  EXPECT_EQ(rights() & perms::group_read, perms::group_read);
}

TEST_F(StateFileTest, WhatIsNotItsOwnKeepsItsRights) {
  using std::filesystem::perms;
  std::ofstream(database_path_) << "a database";
  std::filesystem::permissions(database_path_, perms(0600));
  const std::filesystem::path script = directory_.Path() / "script";
  std::ofstream(script) << "#!/bin/sh\n";
  std::filesystem::permissions(script, perms(0755));
  std::filesystem::create_symlink("script", path_);
  EXPECT_THROW(StateFile(database_path_, 1), DatabaseError);
  EXPECT_EQ(std::filesystem::status(script).permissions(), perms(0755));
  std::filesystem::remove(script);
  EXPECT_THROW(StateFile(database_path_, 1), DatabaseError);
  EXPECT_FALSE(std::filesystem::exists(script));
}

TEST_F(StateFileTest, APipeInItsPlaceIsLeftAlone) {
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  EXPECT_THROW(StateFile(database_path_, 1), DatabaseError);
  EXPECT_TRUE(std::filesystem::is_fifo(path_));
}

TEST_F(StateFileTest, BelongsToTheDatabaseWhateverItsName) {
  const std::filesystem::path database = directory_.Path() / "d.db";
  WriteSyntheticDatabase(database, Schema::kColmap38, MakePlaces(1, 2, 5, 1));
  const std::filesystem::path link = directory_.Path() / "link.db";
  std::filesystem::create_symlink(database, link);
  EXPECT_EQ(StateFile::PathFor(link), StateFile::PathFor(database));
}

TEST(Fingerprints, ChangeWithTheFeatures) {
  TestDirectory directory;
  const std::filesystem::path path = directory.Path() / "d.db";
  WriteSyntheticDatabase(path, Schema::kColmap42, MakePlaces(1, 4, 40, 1));
  const auto read = [&] {
    Database database(path, sqlite::Access::kRead, 1);
    return database.ReadFingerprints(database.ReadImages());
  };
  const std::vector<ImageFingerprint> before = read();
  ASSERT_EQ(before.size(), 4U);
  EXPECT_NE(before[0].features, before[1].features);
  sqlite::Connection connection(path, sqlite::Access::kReadWrite, 1);
  // Image 2 gets the features of image 1, image 3 loses them, image 4 gets other keypoints.
  connection.Execute(
      "UPDATE descriptors SET data = (SELECT data FROM descriptors WHERE image_id = 1) "
      "WHERE image_id = 2");
  connection.Execute("UPDATE descriptors SET rows = 0, data = NULL WHERE image_id = 3");
  connection.Execute("UPDATE keypoints SET data = zeroblob(length(data)) WHERE image_id = 4");
  const std::vector<ImageFingerprint> after = read();
  ASSERT_EQ(after.size(), 3U);
  EXPECT_EQ(after[0].features, before[0].features);
  EXPECT_NE(after[1].features, before[1].features);
  EXPECT_EQ(after[2].id, 4U);
  EXPECT_NE(after[2].features, before[3].features);
}

}  // namespace
}  // namespace colmap_graphmatch
