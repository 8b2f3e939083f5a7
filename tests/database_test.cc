#include "colmap_graphmatch/database/database.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/shard.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::SizeIs;

constexpr double kLockTimeout = 0.2;

// The message of the error that a call throws, empty if it throws none.
template <typename ErrorType = DatabaseError, typename Function>
std::string MessageOf(const Function& function) {
  try {
    function();
  } catch (const ErrorType& error) {
    return error.what();
  }
  return "";
}

class DatabaseTest : public ::testing::Test {
 protected:
  std::filesystem::path Path() const { return directory_.Path() / "my database.db"; }

  Database Open() const { return Database(Path(), sqlite::Access::kReadWrite, kLockTimeout); }

  void Write(Schema schema = Schema::kColmap38) const {
    WriteSyntheticDatabase(Path(), schema, MakePlaces(2, 3, 10, 1));
  }

  void Execute(const std::string& sql) const {
    sqlite::Connection(Path(), sqlite::Access::kReadWrite, 1).Execute(sql);
  }

  std::int64_t Query(const std::string& sql) const {
    sqlite::Connection database(Path(), sqlite::Access::kRead, 1);
    sqlite::Statement statement(database, sql);
    return statement.Step() && !statement.IsNull(0) ? statement.Int(0) : -1;
  }

  std::string ReadImagesMessage() const {
    return MessageOf([this] { Open().ReadImages(); });
  }

  TestDirectory directory_;
};

PairGeometry MakeRows(ImagePair pair, std::uint32_t num_inliers) {
  PairGeometry result;
  result.pair = pair;
  for (std::uint32_t i = 0; i < num_inliers; ++i) result.matches.push_back({i, i});
  result.geometry.inliers = result.matches;
  if (num_inliers > 0) result.geometry.configuration = TwoViewConfiguration::kUncalibrated;
  return result;
}

Matrix3 MatrixOf(double first) { return {first, 2, 3, 4, 5, 6, 7, 8, 9}; }

class AnySchema : public DatabaseTest, public ::testing::WithParamInterface<Schema> {};

TEST_P(AnySchema, ReadsImagesAndFeatures) {
  const std::vector<SyntheticImage> images = MakePlaces(2, 3, 10, 1);
  WriteSyntheticDatabase(Path(), GetParam(), images);
  Database database = Open();
  const std::vector<ImageRecord> records = database.ReadImages();
  ASSERT_THAT(records, SizeIs(6));
  for (std::size_t i = 0; i < records.size(); ++i) {
    EXPECT_EQ(records[i].id, i + 1);
    EXPECT_EQ(records[i].name, images[i].name);
    EXPECT_EQ(records[i].num_features, 10U);
    EXPECT_EQ(database.ReadDescriptors(records[i].id).data, images[i].descriptors.data);
    const Keypoints keypoints = database.ReadKeypoints(records[i].id);
    EXPECT_EQ(keypoints.num_rows, 10U);
    EXPECT_FLOAT_EQ(keypoints.Scale(5), 1.5F);
  }
}

TEST_P(AnySchema, WritesPairsAndReadsThemBack) {
  Write(GetParam());
  Database database = Open();
  PairGeometry edge = MakeRows(ImagePair(1, 2), 20);
  edge.geometry.F = MatrixOf(1);
  database.WritePairs({edge, MakeRows(ImagePair(4, 3), 0)});
  const std::vector<TestedPair> tested = database.ReadTestedPairs();
  ASSERT_THAT(tested, SizeIs(2));
  EXPECT_EQ(tested[0].pair, ImagePair(1, 2));
  EXPECT_EQ(tested[0].num_inliers, 20U);
  EXPECT_EQ(tested[0].config, 3);
  EXPECT_EQ(tested[1].pair, ImagePair(3, 4));
  EXPECT_EQ(tested[1].num_inliers, 0U);
  EXPECT_EQ(Query("SELECT length(F) FROM two_view_geometries WHERE rows = 20"), 72);
  EXPECT_EQ(Query("SELECT length(data) FROM matches WHERE rows = 20"), 160);
  EXPECT_EQ(Query("SELECT count(*) FROM matches WHERE rows = 0 AND cols = 2 AND data IS NULL"), 1);
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries WHERE rows = 0 AND cols = 2 AND data "
                  "IS NULL AND config = 0 AND F IS NULL"),
            1);
}

TEST_P(AnySchema, MarksUnsetMatricesAsThatVersionDoes) {
  Write(GetParam());
  Database database = Open();
  PairGeometry edge = MakeRows(ImagePair(1, 2), 20);
  edge.geometry.F = MatrixOf(1);
  database.WritePairs({edge});
  const bool zeros = GetParam() == Schema::kColmap38;
  EXPECT_EQ(Query("SELECT E = zeroblob(72) AND H = zeroblob(72) AND qvec = zeroblob(32) AND tvec = "
                  "zeroblob(24) FROM two_view_geometries"),
            zeros ? 1 : -1);
  EXPECT_EQ(Query("SELECT E IS NULL AND H IS NULL AND qvec IS NULL AND tvec IS NULL FROM "
                  "two_view_geometries"),
            zeros ? 0 : 1);
}

TEST_P(AnySchema, KeepsAPoseWithoutTranslationWhole) {
  // COLMAP 4 refuses half a pose.
  Write(GetParam());
  Database database = Open();
  PairGeometry edge = MakeRows(ImagePair(1, 2), 20);
  edge.geometry.pose = RelativePose{{0.5, 0.5, 0.5, 0.5}, {0, 0, 0}};
  database.WritePairs({edge});
  EXPECT_EQ(Query("SELECT length(qvec) = 32 AND tvec = zeroblob(24) FROM two_view_geometries"), 1);
}

TEST_P(AnySchema, ReadsBackWhatItWrote) {
  Write(GetParam());
  PairGeometry edge = MakeRows(ImagePair(1, 2), 5);
  edge.geometry.configuration = TwoViewConfiguration::kPlanar;
  edge.geometry.F = MatrixOf(-0.0);
  edge.geometry.E = MatrixOf(0.1);
  edge.geometry.pose = RelativePose{{0.5, -0.5, 0.5, 0.5}, {1, 0, -2}};
  if (GetParam() == Schema::kColmap42) edge.geometry.cameras[1] = sqlite::Blob(40, 7);
  {
    Database database = Open();
    database.WritePairs({edge});
    EXPECT_EQ(database.ReadInliers(ImagePair(1, 2)), edge.geometry.inliers);
    EXPECT_THAT(database.ReadInliers(ImagePair(1, 3)), IsEmpty());
  }
  sqlite::Connection connection(Path(), sqlite::Access::kRead, kLockTimeout);
  const TwoViewGeometryCodec codec(connection.Columns("two_view_geometries"), false);
  sqlite::Statement select(connection,
                           "SELECT " + JoinColumns(codec.Columns()) + " FROM two_view_geometries");
  ASSERT_TRUE(select.Step());
  const TwoViewGeometry read = codec.Decode(select, 0, 10, 10);
  EXPECT_EQ(read.configuration, TwoViewConfiguration::kPlanar);
  EXPECT_EQ(read.inliers, edge.geometry.inliers);
  EXPECT_EQ(read.F, edge.geometry.F);
  EXPECT_EQ(read.E, edge.geometry.E);
  EXPECT_EQ(read.H, std::nullopt);
  ASSERT_TRUE(read.pose.has_value());
  EXPECT_EQ(read.pose->rotation, edge.geometry.pose->rotation);
  EXPECT_EQ(read.pose->translation, edge.geometry.pose->translation);
  EXPECT_EQ(read.cameras, edge.geometry.cameras);
}

TEST_F(DatabaseTest, InliersOfFeaturesThatAreGone) {
  Write();
  Database database = Open();
  database.WritePairs({MakeRows(ImagePair(1, 2), 5)});
  Execute("UPDATE keypoints SET rows = 3 WHERE image_id = 2");
  EXPECT_THAT(MessageOf([&] { database.ReadInliers(ImagePair(1, 2)); }),
              AllOf(HasSubstr("ids 1 and 2"), HasSubstr("extracted again")));
}

TEST_P(AnySchema, ReadsCameras) {
  Write(GetParam());
  Execute(
      "UPDATE cameras SET model = 2, width = 640, height = 480, prior_focal_length = 1, params "
      "= CAST(x'0000000000408F400000000000007440000000000000E0BF9A9999999999B93F' AS BLOB)");
  const std::vector<ImageRecord> images = Open().ReadImages();
  const std::map<CameraId, Camera> cameras = Open().ReadCameras();
  const Camera& camera = cameras.at(images.front().camera_id);
  EXPECT_EQ(camera.id, images.front().camera_id);
  EXPECT_EQ(camera.model_id, 2);
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  EXPECT_THAT(camera.params, ElementsAre(1000, 320, -0.5, 0.1));
  EXPECT_TRUE(camera.has_prior_focal_length);
}

TEST_F(DatabaseTest, PositionsOfColumns) {
  Write();
  EXPECT_THAT(Open().ReadPositions(), IsEmpty());
  Execute("UPDATE images SET prior_tx = 48.5, prior_ty = -2.25, prior_tz = 30 WHERE image_id = 2");
  Execute("UPDATE images SET prior_tx = 0, prior_ty = 0, prior_tz = 0 WHERE image_id = 3");
  const std::map<ImageId, PositionPrior> geographic = Open().ReadPositions();
  ASSERT_THAT(geographic, SizeIs(1));
  EXPECT_EQ(geographic.at(2).system, PositionPrior::System::kGeographic);
  EXPECT_THAT(geographic.at(2).position, ElementsAre(48.5, -2.25, 30));
  EXPECT_EQ(geographic.at(2).accuracy, 0);
  // Half of them are no latitudes.
  Execute("UPDATE images SET prior_tx = 480, prior_ty = 1, prior_tz = 3 WHERE image_id = 1");
  const std::map<ImageId, PositionPrior> cartesian = Open().ReadPositions();
  ASSERT_THAT(cartesian, SizeIs(2));
  EXPECT_EQ(cartesian.at(2).system, PositionPrior::System::kCartesian);
  // One of three stands for none.
  Execute("UPDATE images SET prior_tx = 10, prior_ty = 1, prior_tz = 3 WHERE image_id = 3");
  EXPECT_EQ(Open().ReadPositions().at(2).system, PositionPrior::System::kGeographic);
  // A newer COLMAP has opened it.
  Execute(
      "CREATE TABLE pose_priors(image_id INTEGER PRIMARY KEY NOT NULL, position BLOB, "
      "coordinate_system INTEGER NOT NULL)");
  EXPECT_THAT(Open().ReadPositions(), SizeIs(3));
}

TEST_F(DatabaseTest, PositionsOfPosePriors) {
  Write(Schema::kColmap310);
  EXPECT_THAT(Open().ReadPositions(), IsEmpty());
  // As they are stored: 1, 2 and 0.5; and a matrix with 4, NaN and 1 on its diagonal, or 4, 9, 1.
  const std::string numbers = "000000000000F03F0000000000000040000000000000E03F";
  const std::string none = "0000000000000000";
  const std::string variances[] = {"0000000000001040", "0000000000002240", "000000000000F03F"};
  const std::string nan = "000000000000F87F";
  const auto covariance = [&](const std::string& middle) {
    return "x'" + variances[0] + none + none + none + middle + none + none + none + variances[2] +
           "'";
  };
  Execute(
      "CREATE TABLE pose_priors(image_id INTEGER PRIMARY KEY NOT NULL, position BLOB, "
      "coordinate_system INTEGER NOT NULL, position_covariance BLOB)");
  EXPECT_THAT(Open().ReadPositions(), IsEmpty());
  // Two of three numbers are none.
  Execute("INSERT INTO pose_priors VALUES(1, x'" + numbers + "', 0, NULL), (2, x'" + numbers +
          "', 1, " + covariance(variances[1]) + "), (3, x'" + numbers.substr(0, 32) +
          "', 0, NULL), (4, NULL, 0, NULL), (5, x'" + numbers.substr(0, 32) + nan + "', -1, " +
          covariance(nan) + "), (6, 'a text of 24 characters.', 'text', 'text'), (4294967298, x'" +
          numbers + "', 0, NULL)");
  const std::map<ImageId, PositionPrior> positions = Open().ReadPositions();
  ASSERT_THAT(positions, SizeIs(2));
  EXPECT_EQ(positions.at(1).system, PositionPrior::System::kGeographic);
  EXPECT_EQ(positions.at(1).accuracy, 0);
  EXPECT_EQ(positions.at(2).system, PositionPrior::System::kCartesian);
  EXPECT_THAT(positions.at(2).position, ElementsAre(1, 2, 0.5));
  EXPECT_EQ(positions.at(2).accuracy, 3);
}

TEST_F(DatabaseTest, PositionsOfWhatCamerasSaw) {
  Write(Schema::kColmap42);
  Execute(
      "CREATE TABLE pose_priors(pose_prior_id INTEGER PRIMARY KEY NOT NULL, corr_data_id INTEGER "
      "NOT NULL, corr_sensor_id INTEGER NOT NULL, corr_sensor_type INTEGER NOT NULL, position "
      "BLOB, position_covariance BLOB, gravity BLOB, coordinate_system INTEGER NOT NULL)");
  const std::string numbers = "x'000000000000F03F0000000000000040000000000000E03F'";
  // The second is of another sensor.
  Execute("INSERT INTO pose_priors VALUES(1, 3, 1, 0, " + numbers + ", NULL, NULL, 0), (2, 2, 1, " +
          "1, " + numbers + ", NULL, NULL, 0)");
  const std::map<ImageId, PositionPrior> positions = Open().ReadPositions();
  ASSERT_THAT(positions, SizeIs(1));
  EXPECT_EQ(positions.at(3).system, PositionPrior::System::kGeographic);
  EXPECT_THAT(positions.at(3).position, ElementsAre(1, 2, 0.5));
  // Of a version that is not known.
  Execute("ALTER TABLE pose_priors RENAME COLUMN position TO place");
  EXPECT_THAT(Open().ReadPositions(), IsEmpty());
}

TEST_F(DatabaseTest, CamerasThatCannotBeAreReadAsTheyAre) {
  Write();
  const auto read = [this](const std::string& values) {
    Execute("UPDATE cameras SET " + values);
    return Open().ReadCameras().begin()->second;
  };
  EXPECT_THAT(read("params = zeroblob(24)").params, SizeIs(3));
  EXPECT_THAT(read("params = zeroblob(43)").params, SizeIs(5));
  EXPECT_THAT(read("params = NULL").params, IsEmpty());
  EXPECT_THAT(read("params = zeroblob(100000)").params, SizeIs(64));
  EXPECT_EQ(read("width = -7").width, -1);
  EXPECT_EQ(read("height = 4294967299").height, std::numeric_limits<int>::max());
  EXPECT_EQ(read("model = 4294967299").model_id, std::numeric_limits<int>::max());
}

TEST_P(AnySchema, LeavesTheVersionAlone) {
  Write(GetParam());
  const std::int64_t version = Query("PRAGMA user_version");
  Open().WritePairs({MakeRows(ImagePair(1, 2), 20)});
  EXPECT_EQ(Query("PRAGMA user_version"), version);
  sqlite::Connection database(Path(), sqlite::Access::kRead, 1);
  sqlite::Statement check(database, "PRAGMA integrity_check");
  ASSERT_TRUE(check.Step());
  EXPECT_EQ(check.Text(0), "ok");
}

INSTANTIATE_TEST_SUITE_P(Database, AnySchema,
                         ::testing::Values(Schema::kColmap38, Schema::kColmap310,
                                           Schema::kColmap42));

TEST_F(DatabaseTest, ImagesWithoutFeaturesAreData) {
  std::vector<SyntheticImage> images = MakePlaces(1, 3, 10, 1);
  images[1].descriptors = {};
  images[1].keypoints = {};
  WriteSyntheticDatabase(Path(), Schema::kColmap38, images);
  Execute("DELETE FROM descriptors WHERE image_id = 3");
  Database database = Open();
  const std::vector<ImageRecord> records = database.ReadImages();
  EXPECT_EQ(records[0].num_features, 10U);
  EXPECT_EQ(records[1].num_features, 0U);
  EXPECT_EQ(records[2].num_features, 0U);
  EXPECT_EQ(database.ReadDescriptors(2).num_rows, 0U);
  EXPECT_EQ(database.ReadDescriptors(3).num_rows, 0U);
}

TEST_F(DatabaseTest, MissingFile) {
  EXPECT_THAT(MessageOf([this] { Open(); }),
              AllOf(HasSubstr("no database at"), HasSubstr("feature_extractor")));
  EXPECT_FALSE(std::filesystem::exists(Path()));
}

TEST_F(DatabaseTest, Directory) {
  std::filesystem::create_directory(Path());
  EXPECT_THAT(MessageOf([this] { Open(); }), HasSubstr("is a directory"));
}

TEST_F(DatabaseTest, EmptyFile) {
  std::ofstream(Path()).close();
  EXPECT_THAT(MessageOf([this] { Open(); }), HasSubstr("is an empty file"));
}

TEST_F(DatabaseTest, NotSqlite) {
  std::ofstream(Path()) << std::string(5000, 'x');
  EXPECT_THAT(MessageOf([this] { Open(); }), HasSubstr("is not a SQLite database"));
}

TEST_F(DatabaseTest, NotColmap) {
  { CreateColmapDatabase(Path(), Schema::kColmap38).Execute("DROP TABLE descriptors"); }
  EXPECT_THAT(MessageOf([this] { Open(); }),
              AllOf(HasSubstr("not a database of COLMAP"), HasSubstr("no table descriptors")));
}

TEST_F(DatabaseTest, TooOldForColmap38) {
  {
    CreateColmapDatabase(Path(), Schema::kColmap38)
        .Execute("ALTER TABLE two_view_geometries DROP COLUMN H");
  }
  EXPECT_THAT(MessageOf([this] { Open(); }), HasSubstr("has no column H"));
}

TEST_F(DatabaseTest, NoImages) {
  CreateColmapDatabase(Path(), Schema::kColmap38);
  EXPECT_THAT(ReadImagesMessage(), HasSubstr("has no images"));
}

TEST_F(DatabaseTest, NoFeaturesAtAll) {
  Write();
  Execute("DELETE FROM descriptors");
  EXPECT_THAT(ReadImagesMessage(), HasSubstr("None of the 6 images"));
}

TEST_F(DatabaseTest, TruncatedFile) {
  Write();
  Execute("PRAGMA wal_checkpoint(TRUNCATE)");
  std::filesystem::resize_file(Path(), std::filesystem::file_size(Path()) / 2);
  EXPECT_THAT(MessageOf([this] {
                Database database = Open();
                for (const ImageRecord& image : database.ReadImages()) {
                  database.ReadDescriptors(image.id);
                }
              }),
              HasSubstr("damaged"));
}

struct Corruption {
  std::string name;
  std::string sql;
  std::string message;
};

class Corrupt : public DatabaseTest, public ::testing::WithParamInterface<Corruption> {};

TEST_P(Corrupt, NamesTheImageAndTheFault) {
  Write();
  Execute(GetParam().sql + " WHERE image_id = 4");
  EXPECT_THAT(ReadImagesMessage(),
              AllOf(HasSubstr("\"place1/photo 0.jpg\" (id 4)"), HasSubstr(GetParam().message)));
}

INSTANTIATE_TEST_SUITE_P(
    Features, Corrupt,
    ::testing::Values(
        Corruption{"Short", "UPDATE descriptors SET data = zeroblob(1279)", "the blob has 1279"},
        Corruption{"Missing", "UPDATE descriptors SET data = NULL", "the blob has 0"},
        Corruption{"Rows", "UPDATE descriptors SET rows = 11", "11 x 128"},
        Corruption{"Negative", "UPDATE descriptors SET rows = -1", "-1 x 128"},
        Corruption{"Huge", "UPDATE descriptors SET rows = 9223372036854775807",
                   "the blob has 1280"},
        Corruption{"Float", "UPDATE descriptors SET data = zeroblob(5120)", "floating-point"},
        Corruption{"Dim", "UPDATE descriptors SET cols = 64, data = zeroblob(640)", "10 x 64"},
        Corruption{"Text", "UPDATE descriptors SET data = CAST(zeroblob(1280) AS TEXT)",
                   "the blob has 0"},
        Corruption{"KeypointText",
                   "UPDATE keypoints SET data = replace(hex(zeroblob(80)), '0', 'a')",
                   "has 0 bytes"},
        Corruption{"KeypointRows", "UPDATE keypoints SET rows = 9", "10 descriptors but 9"},
        Corruption{"KeypointCols", "UPDATE keypoints SET cols = 5", "5 columns"},
        Corruption{"KeypointData", "UPDATE keypoints SET data = zeroblob(12)", "has 12 bytes"}),
    [](const auto& corruption) { return corruption.param.name; });

TEST_F(DatabaseTest, FeaturesOfAnotherType) {
  Write(Schema::kColmap42);
  Execute("UPDATE descriptors SET type = 1 WHERE image_id = 2");
  EXPECT_THAT(ReadImagesMessage(), AllOf(HasSubstr("(id 2)"), HasSubstr("ALIKED")));
}

TEST_F(DatabaseTest, ImageIdOutOfRange) {
  Write();
  Execute(
      "PRAGMA ignore_check_constraints = 1; UPDATE images SET image_id = 2147483647 WHERE image_id "
      "= 6");
  EXPECT_THAT(ReadImagesMessage(), HasSubstr("outside COLMAP's range"));
}

TEST_F(DatabaseTest, NamesLongerThanAnyPath) {
  Write();
  Execute("UPDATE images SET name = CAST(zeroblob(4096) AS TEXT) WHERE image_id = 2");
  EXPECT_THAT(Open().ReadImages(), SizeIs(6));
  Execute("UPDATE images SET name = CAST(zeroblob(4097) AS TEXT) WHERE image_id = 2");
  EXPECT_THAT(ReadImagesMessage(), HasSubstr("id 2 has 4097 bytes"));
}

// What the program looks up by a key must have it: rows of the same image in three tables without
// keys would be joined to their product.
TEST_F(DatabaseTest, TablesWithoutKeys) {
  for (const char* table : {"images", "keypoints", "two_view_geometries"}) {
    std::filesystem::remove(Path());
    Write();
    Execute("CREATE TABLE copy AS SELECT * FROM " + std::string(table) + "; DROP TABLE " + table +
            "; ALTER TABLE copy RENAME TO " + table);
    EXPECT_THAT(MessageOf([this] { Open(); }),
                AllOf(HasSubstr(table), HasSubstr("as its INTEGER PRIMARY KEY")));
  }
}

// The rows of this one have no end.
TEST_F(DatabaseTest, AViewInPlaceOfATable) {
  Write();
  Execute(
      "DROP TABLE images; CREATE VIEW images AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT "
      "i + 1 FROM n) SELECT i AS image_id, 'a' AS name, 1 AS camera_id FROM n");
  EXPECT_THAT(MessageOf([this] { Open(); }), HasSubstr("its images is a view"));
}

TEST_F(DatabaseTest, NothingInTheFileIsRun) {
  Write();
  Execute(
      "CREATE VIEW mine AS SELECT * FROM images; CREATE INDEX lower_names ON "
      "images(lower(name)); CREATE TRIGGER harm AFTER INSERT ON two_view_geometries BEGIN DELETE "
      "FROM images; END");
  Database database = Open();
  database.WritePairs({MakeRows(ImagePair(1, 2), 20)});
  EXPECT_THAT(database.ReadImages(), SizeIs(6));
  sqlite::Connection connection(Path(), sqlite::Access::kRead, 1);
  EXPECT_THAT(MessageOf([&] { sqlite::Statement(connection, "SELECT * FROM mine"); }),
              HasSubstr("prohibited"));
  EXPECT_THAT(
      MessageOf([&] { connection.Execute("CREATE VIRTUAL TABLE temp.text USING fts4(text)"); }),
      HasSubstr("no such module"));
  EXPECT_THAT(MessageOf([&] {
                Execute("PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = 'x'");
              }),
              HasSubstr("may not be modified"));
  EXPECT_EQ(Query("PRAGMA trusted_schema"), 0);
  EXPECT_EQ(Query("PRAGMA cell_size_check"), 1);
}

TEST_F(DatabaseTest, NothingIsComputedOnWriting) {
  const std::string columns = "pair_id INTEGER PRIMARY KEY, rows, cols, data, config, F, E, H";
  const auto message = [&](const std::string& rest) {
    std::filesystem::remove(Path());
    Write();
    Execute("DROP TABLE two_view_geometries; CREATE TABLE two_view_geometries(" + columns + rest);
    return MessageOf([this] { Open().WritePairs({MakeRows(ImagePair(1, 2), 20)}); });
  };
  for (const char* rest :
       {", large AS (hex(zeroblob(400000000))))", ", large AS (hex(rows)) STORED)",
        ", large DEFAULT (hex(zeroblob(400000000))))",
        "); CREATE INDEX i ON two_view_geometries(hex(rows))",
        "); CREATE INDEX i ON two_view_geometries(rows) WHERE hex(rows) > 7"}) {
    EXPECT_THAT(message(rest), HasSubstr("its table two_view_geometries has generated columns"))
        << rest;
  }
  EXPECT_EQ(message(", more DEFAULT 7, CHECK(hex(rows) = 'not so'))"), "");
  EXPECT_EQ(message("); CREATE INDEX i ON two_view_geometries(config, rows)"), "");
}

TEST_F(DatabaseTest, StepsWithoutEnd) {
  Write();
  sqlite::Connection connection(Path(), sqlite::Access::kRead, 1);
  sqlite::Statement endless(
      connection,
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i FROM n WHERE i < "
      "3 OR i < 0");
  EXPECT_TRUE(endless.Step());
  EXPECT_TRUE(endless.Step());
  EXPECT_THAT(MessageOf([&] { endless.Step(); }), HasSubstr("does not come to an end"));
  // What earlier steps took does not count.
  sqlite::Statement slow(connection,
                         "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i "
                         "FROM n WHERE i % 800000 = 0 LIMIT 5");
  int num = 0;
  while (slow.Step()) ++num;
  EXPECT_EQ(num, 5);
}

TEST_F(DatabaseTest, WritesAreRolledBackUnlessAllSucceed) {
  Write();
  Database database = Open();
  Execute("CREATE UNIQUE INDEX refuse_equal_rows ON two_view_geometries(rows)");
  EXPECT_THAT(MessageOf([&] {
                database.WritePairs({MakeRows(ImagePair(1, 2), 20), MakeRows(ImagePair(1, 3), 20)});
              }),
              HasSubstr("UNIQUE constraint failed"));
  EXPECT_EQ(Query("SELECT count(*) FROM matches"), 0);
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 0);
  database.WritePairs({MakeRows(ImagePair(1, 2), 20)});
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 1);
}

TEST_F(DatabaseTest, PairsOfOthersAreNotOverwritten) {
  Write();
  Database database = Open();
  database.WritePairs({MakeRows(ImagePair(1, 2), 20)});
  database.WritePairs({MakeRows(ImagePair(1, 2), 5), MakeRows(ImagePair(1, 3), 6)});
  EXPECT_EQ(Query("SELECT rows FROM two_view_geometries ORDER BY pair_id"), 20);
  EXPECT_EQ(Query("SELECT rows FROM matches ORDER BY pair_id"), 20);
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 2);
}

TEST_F(DatabaseTest, TestedPairsAscendAndKeysOfNoPairAreLeftOut) {
  Write();
  Database database = Open();
  database.WritePairs({MakeRows(ImagePair(4, 5), 20), MakeRows(ImagePair(1, 2), 20)});
  const std::vector<std::string> keys = {std::to_string(kMaxNumImages * 3 + 1),
                                         "-5",
                                         "7",
                                         std::to_string(kMaxNumImages),
                                         "9223372036854775807",
                                         std::to_string(EncodePair({3, 4}) - 1)};
  for (const std::string& key : keys) {
    Execute("INSERT INTO two_view_geometries(pair_id, rows, cols, config) VALUES(" + key +
            ", 20, 2, 2)");
  }
  std::vector<ImagePair> pairs;
  for (const TestedPair& tested : database.ReadTestedPairs()) pairs.push_back(tested.pair);
  EXPECT_THAT(pairs, ElementsAre(ImagePair(1, 2), ImagePair(4, 5)));
}

TEST_F(DatabaseTest, MatchesWithoutGeometryAreReplaced) {
  Write();
  Execute("INSERT INTO matches VALUES(" + std::to_string(EncodePair(ImagePair(1, 2))) +
          ", 0, 2, NULL)");
  Open().WritePairs({MakeRows(ImagePair(1, 2), 20)});
  EXPECT_EQ(Query("SELECT rows FROM matches"), 20);
}

TEST_F(DatabaseTest, WaitsForALockAndSaysWhoHoldsIt) {
  Write();
  Database database = Open();
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      sqlite::Connection other(Path(), sqlite::Access::kReadWrite, 1);
      other.Execute("BEGIN IMMEDIATE");
      if (::write(ready[1], "x", 1) == 1) ::pause();
    } catch (...) {
    }
    ::_exit(1);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  const std::string message =
      MessageOf<DatabaseLockedError>([&] { database.WritePairs({MakeRows(ImagePair(1, 2), 20)}); });
  EXPECT_THAT(message,
              AllOf(HasSubstr("another process kept it locked for 0.2 s"),
                    HasSubstr("process " + std::to_string(child)), HasSubstr("database_test")));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ::close(ready[0]);
  ::close(ready[1]);
  database.WritePairs({MakeRows(ImagePair(1, 2), 20)});
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 1);
}

TEST_F(DatabaseTest, AStopRequestEndsTheWaitForALock) {
  Write();
  StopRequest stop;
  Database database(Path(), sqlite::Access::kReadWrite, {60, &stop});
  sqlite::Connection other(Path(), sqlite::Access::kReadWrite, 1);
  const auto raise_soon = [&stop] {
    return std::thread([&stop] {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      stop.Raise();
    });
  };
  {
    const sqlite::Transaction lock(other);
    std::thread user = raise_soon();
    EXPECT_THROW(database.CheckWritable(), StoppedError);
    user.join();
    // What was computed is given up at the second request only.
    user = raise_soon();
    EXPECT_THROW(database.WritePairs({MakeRows(ImagePair(1, 2), 20)}), StoppedError);
    user.join();
    EXPECT_TRUE(stop.Abandon());
  }
  database.WritePairs({MakeRows(ImagePair(1, 2), 20)});
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 1);
}

TEST_F(DatabaseTest, PairsOfOthersAreReportedAsTheyAre) {
  Write();
  Database database = Open();
  EXPECT_THAT(database.WritePairs({MakeRows(ImagePair(1, 2), 20)}), SizeIs(0));
  const std::vector<TestedPair> of_others =
      database.WritePairs({MakeRows(ImagePair(1, 2), 5), MakeRows(ImagePair(1, 3), 6)});
  ASSERT_THAT(of_others, SizeIs(1));
  EXPECT_EQ(of_others.front().pair, ImagePair(1, 2));
  EXPECT_EQ(of_others.front().num_inliers, 20U);
  EXPECT_EQ(of_others.front().config, 3);
}

class ChangedFeatures : public DatabaseTest {
 protected:
  void SetUp() override {
    Write();
    database_ = std::make_unique<Database>(Open());
    const std::vector<ImageRecord> images = database_->ReadImages();
    database_->ExpectFeatures(images, database_->ReadFingerprints(images));
  }

  // What writing a pair of images 1 and 2 says after another program executed this.
  std::string After(const std::string& sql) {
    Execute(sql);
    return MessageOf([&] { database_->WritePairs({MakeRows(ImagePair(1, 2), 20)}); });
  }

  std::unique_ptr<Database> database_;
};

TEST_F(ChangedFeatures, OfEqualNumberAreNoticed) {
  database_->WritePairs({MakeRows(ImagePair(1, 3), 20)});
  EXPECT_THAT(After("UPDATE descriptors SET data = (SELECT data FROM descriptors WHERE image_id = "
                    "4) WHERE image_id = 2"),
              AllOf(HasSubstr("place0/photo 1.jpg"), HasSubstr("changed during the run")));
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 1);
  // Pairs of other images are what they were.
  database_->WritePairs({MakeRows(ImagePair(3, 4), 20)});
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 2);
}

TEST_F(ChangedFeatures, OfKeypointsAloneAreNoticed) {
  EXPECT_THAT(After("UPDATE keypoints SET data = zeroblob(length(data)) WHERE image_id = 1"),
              HasSubstr("changed during the run"));
}

TEST_F(ChangedFeatures, ThatAreGoneAreNoticed) {
  EXPECT_THAT(After("DELETE FROM descriptors WHERE image_id = 1"),
              HasSubstr("changed during the run"));
}

TEST_F(ChangedFeatures, OfOtherImagesDoNotMatter) {
  EXPECT_EQ(After("DELETE FROM descriptors WHERE image_id = 5"), "");
  EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 1);
}

TEST_F(DatabaseTest, AnotherFileInItsPlaceIsNoticed) {
  for (const bool is_replaced : {true, false}) {
    Write();
    Execute("PRAGMA journal_mode = DELETE");
    Database database = Open();
    database.WritePairs({MakeRows(ImagePair(1, 2), 20)});
    if (is_replaced) {
      std::filesystem::copy_file(Path(), directory_.Path() / "copy");
      std::filesystem::rename(directory_.Path() / "copy", Path());
    } else {
      std::filesystem::remove(Path());
    }
    EXPECT_THAT(MessageOf([&] { database.CheckInPlace(); }), HasSubstr("replaced by another file"));
    EXPECT_THAT(MessageOf([&] { database.WritePairs({MakeRows(ImagePair(1, 3), 20)}); }),
                HasSubstr("replaced by another file"));
    if (is_replaced) {
      EXPECT_EQ(Query("SELECT count(*) FROM two_view_geometries"), 1);
    }
    std::filesystem::remove(Path());
  }
}

// The start of the content of a page, in its header, points behind rows: SQLite reads them all and
// puts the next row over them.
TEST_F(DatabaseTest, RowsAreNotWrittenOverOthers) {
  for (const char* table : {"matches", "two_view_geometries"}) {
    std::filesystem::remove(Path());
    Write();
    Open().WritePairs({MakeRows(ImagePair(1, 2), 5), MakeRows(ImagePair(1, 3), 6)});
    Execute("PRAGMA journal_mode = DELETE");
    const std::int64_t page =
        Query("SELECT rootpage FROM sqlite_schema WHERE name = '" + std::string(table) + "'");
    {
      std::fstream file(Path(), std::ios::in | std::ios::out | std::ios::binary);
      file.seekp((page - 1) * Query("PRAGMA page_size") + 5);
      file.write("\x0F\xFF", 2);
    }
    const auto content = [&] {
      std::ifstream file(Path(), std::ios::binary);
      return std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    };
    const std::string before = content();
    Database database = Open();
    EXPECT_THAT(database.ReadTestedPairs(), SizeIs(2));
    EXPECT_THAT(
        MessageOf([&] { database.WritePairs({MakeRows(ImagePair(1, 4), 7)}); }),
        AllOf(HasSubstr("damaged where " + std::string(table)), HasSubstr("Nothing was written")));
    EXPECT_EQ(content(), before);
  }
}

TEST_F(DatabaseTest, APipeInItsPlaceOrBesideItIsRefused) {
  Write();
  Execute("PRAGMA journal_mode = DELETE");
  const std::filesystem::path wal = Path().string() + "-wal";
  ASSERT_EQ(::mkfifo(wal.c_str(), 0600), 0);
  EXPECT_THAT(MessageOf([&] { Open(); }), HasSubstr("-wal: it is a pipe"));
  std::filesystem::remove(wal);
  std::filesystem::remove(Path());
  ASSERT_EQ(::mkfifo(Path().c_str(), 0600), 0);
  EXPECT_THAT(MessageOf([&] { Open(); }), HasSubstr("it is a pipe"));
}

TEST_F(DatabaseTest, ReadOnlyFile) {
  Write();
  Execute("PRAGMA journal_mode = DELETE");
  std::filesystem::permissions(Path(), std::filesystem::perms(0444));
  std::filesystem::permissions(directory_.Path(), std::filesystem::perms(0555));
  // Root may write to everything: be nobody for a moment.
  const bool is_root = ::geteuid() == 0;
  ASSERT_TRUE(!is_root || ::seteuid(65534) == 0);
  const std::string message = MessageOf([&] { Open(); });
  ASSERT_TRUE(!is_root || ::seteuid(0) == 0);
  std::filesystem::permissions(directory_.Path(), std::filesystem::perms(0755));
  EXPECT_THAT(message, HasSubstr("read-only"));
}

TEST(IsEdge, FollowsColmap) {
  EXPECT_TRUE(IsEdge(15, 2, 15));
  EXPECT_TRUE(IsEdge(15, 8, 15));
  EXPECT_FALSE(IsEdge(14, 2, 15));
  for (const int config : {0, 1, 7}) EXPECT_FALSE(IsEdge(100, config, 15)) << config;
}

TEST(Keypoints, ScaleOfEveryKind) {
  Keypoints keypoints{1, 2, {3, 4}};
  EXPECT_EQ(keypoints.Scale(0), 0);
  keypoints = {1, 4, {3, 4, 2.5F, 1}};
  EXPECT_EQ(keypoints.Scale(0), 2.5F);
  // A rotation by 30 degrees times diag(4, 2).
  keypoints = {1, 6, {3, 4, 3.4641016F, -1, 2, 1.7320508F}};
  EXPECT_FLOAT_EQ(keypoints.Scale(0), 3);
}

struct SchemaPair {
  Schema source;
  Schema target;
};

class ShardTest : public DatabaseTest, public ::testing::WithParamInterface<SchemaPair> {};

TEST_P(ShardTest, HoldsTheImagesOfItsPairs) {
  Write(GetParam().source);
  Execute("INSERT INTO matches VALUES(" + std::to_string(EncodePair(ImagePair(2, 5))) +
          ", 1, 2, zeroblob(8)), (" + std::to_string(EncodePair(ImagePair(2, 3))) +
          ", 1, 2, zeroblob(8))");
  const std::filesystem::path shard_path = directory_.Path() / "shard.db";
  CreateColmapDatabase(shard_path, GetParam().target);
  FillShard(shard_path, Path(), kLockTimeout, {{ImagePair(2, 5), {}}, {ImagePair(3, 5), {}}}, true);

  sqlite::Connection shard(shard_path, sqlite::Access::kRead, 1);
  sqlite::Statement images(shard, "SELECT image_id, name FROM images ORDER BY image_id");
  for (const int id : {2, 3, 5}) {
    ASSERT_TRUE(images.Step());
    EXPECT_EQ(images.Int(0), id);
    EXPECT_EQ(images.Text(1), ShardImageName(static_cast<ImageId>(id)));
  }
  EXPECT_FALSE(images.Step());
  sqlite::Statement counts(
      shard,
      "SELECT (SELECT count(*) FROM cameras), (SELECT count(*) FROM keypoints), "
      "(SELECT count(*) FROM descriptors), (SELECT count(*) FROM matches)");
  counts.Step();
  EXPECT_EQ(counts.Int(0), 1);
  EXPECT_EQ(counts.Int(1), 3);
  EXPECT_EQ(counts.Int(2), 3);
  EXPECT_EQ(counts.Int(3), 1);
  sqlite::Statement descriptors(shard, "SELECT data FROM descriptors WHERE image_id = 5");
  descriptors.Step();
  EXPECT_EQ(descriptors.CopyBlob(0), Open().ReadDescriptors(5).data);
}

TEST_P(ShardTest, HasTheFeaturesOfItsMatchesAlone) {
  Write(GetParam().source);
  const std::filesystem::path shard_path = directory_.Path() / "shard.db";
  CreateColmapDatabase(shard_path, GetParam().target);
  const FeatureMatches of_25 = {{3, 1}, {0, 5}};
  const FeatureMatches of_35 = {{2, 5}};
  const ShardFeatures features =
      FillShard(shard_path, Path(), kLockTimeout,
                {{ImagePair(2, 5), of_25}, {ImagePair(3, 5), of_35}}, false);
  EXPECT_THAT(features, ElementsAre(Pair(2, ElementsAre(0, 3)), Pair(3, ElementsAre(2)),
                                    Pair(5, ElementsAre(1, 5))));
  {
    Database shard(shard_path, sqlite::Access::kRead, 1);
    Database source = Open();
    for (const auto& [image, numbers] : features) {
      const Keypoints all = source.ReadKeypoints({image, "", 10});
      const Keypoints some = shard.ReadKeypoints({image, "", numbers.size()});
      ASSERT_EQ(some.num_cols, all.num_cols);
      for (std::size_t row = 0; row < numbers.size(); ++row) {
        EXPECT_EQ(some.data[row * all.num_cols], all.data[numbers[row] * all.num_cols]);
      }
    }
    EXPECT_THAT(shard.ReadMatches(ImagePair(2, 5)),
                ElementsAre(FeatureMatch{1, 0}, FeatureMatch{0, 1}));
  }
  sqlite::Connection(shard_path, sqlite::Access::kReadWrite, 1)
      .Execute(
          "INSERT INTO two_view_geometries(pair_id, rows, cols, data, config) SELECT pair_id, "
          "rows, cols, data, 3 FROM matches");
  const std::vector<PairGeometry> results =
      ReadShard(shard_path, {ImagePair(2, 5), ImagePair(3, 5)}, {}, features);
  EXPECT_EQ(results[0].matches, of_25);
  EXPECT_EQ(results[0].geometry.inliers, of_25);
  EXPECT_EQ(results[1].geometry.inliers, of_35);
}

// COLMAP is to say what it thinks of them.
TEST_P(ShardTest, KeypointsThatCannotBeAreCopiedAsTheyAre) {
  Write(GetParam().source);
  Execute("UPDATE keypoints SET rows = 3 WHERE image_id = 2");
  Execute("UPDATE keypoints SET data = NULL WHERE image_id = 3");
  const std::filesystem::path shard_path = directory_.Path() / "shard.db";
  CreateColmapDatabase(shard_path, GetParam().target);
  const ShardFeatures features = FillShard(
      shard_path, Path(), kLockTimeout,
      {{ImagePair(2, 5), FeatureMatches{{3, 1}}}, {ImagePair(3, 5), FeatureMatches{{0, 2}}}},
      false);
  EXPECT_THAT(features, ElementsAre(Pair(5, ElementsAre(1, 2))));
  sqlite::Connection shard(shard_path, sqlite::Access::kRead, 1);
  sqlite::Statement rows(shard, "SELECT rows, length(data) FROM keypoints ORDER BY image_id");
  rows.Step();
  EXPECT_EQ(rows.Int(0), 3);
  rows.Step();
  EXPECT_TRUE(rows.IsNull(1));
}

INSTANTIATE_TEST_SUITE_P(AcrossVersions, ShardTest,
                         ::testing::Values(SchemaPair{Schema::kColmap38, Schema::kColmap38},
                                           SchemaPair{Schema::kColmap38, Schema::kColmap42},
                                           SchemaPair{Schema::kColmap42, Schema::kColmap38},
                                           SchemaPair{Schema::kColmap310, Schema::kColmap42},
                                           SchemaPair{Schema::kColmap42, Schema::kColmap42}));

class ShardMatches : public DatabaseTest, public ::testing::WithParamInterface<const char*> {};

// COLMAP would take them as they are.
TEST_P(ShardMatches, ThatCannotBeAreRefused) {
  Write();
  Execute("INSERT INTO matches VALUES(" + std::to_string(EncodePair(ImagePair(2, 5))) + ", " +
          GetParam() + ")");
  const std::filesystem::path shard_path = directory_.Path() / "shard.db";
  CreateColmapDatabase(shard_path, Schema::kColmap38);
  EXPECT_THAT(MessageOf([&] {
                FillShard(shard_path, Path(), kLockTimeout, {{ImagePair(2, 5), {}}}, false);
              }),
              AllOf(HasSubstr("ids 2 and 5"), HasSubstr("DELETE FROM matches")));
}

INSTANTIATE_TEST_SUITE_P(Shards, ShardMatches,
                         ::testing::Values("1, 2, x'0A00000000000000'", "1, 2, x'090000000A000000'",
                                           "1, 2, x'FFFFFFFFFFFFFFFF'", "2, 2, zeroblob(8)",
                                           "1, 1, zeroblob(8)", "2305843009213693952, 2, NULL",
                                           "-1, 2, zeroblob(8)"));

class ShardResults : public DatabaseTest {
 protected:
  std::vector<PairGeometry> Read() const {
    return ReadShard(Path(), {ImagePair(1, 2)}, {{1, 10}, {2, 10}}, {});
  }
  void Result(const std::string& match_values, const std::string& geometry_values) const {
    const std::string id = std::to_string(EncodePair(ImagePair(1, 2)));
    CreateColmapDatabase(Path(), Schema::kColmap38);
    Execute("INSERT INTO matches VALUES(" + id + ", " + match_values + ")");
    Execute("INSERT INTO two_view_geometries VALUES(" + id + ", " + geometry_values + ")");
  }
};

TEST_F(ShardResults, AreReadWhole) {
  Result("2, 2, x'01000000020000000300000009000000'",
         "1, 2, x'0300000009000000', 3, zeroblob(72), NULL, zeroblob(72), NULL, NULL");
  const std::vector<PairGeometry> results = Read();
  ASSERT_THAT(results, SizeIs(1));
  EXPECT_THAT(results[0].matches, ElementsAre(FeatureMatch{1, 2}, FeatureMatch{3, 9}));
  EXPECT_THAT(results[0].geometry.inliers, ElementsAre(FeatureMatch{3, 9}));
  EXPECT_EQ(results[0].geometry.configuration, TwoViewConfiguration::kUncalibrated);
  EXPECT_FALSE(results[0].geometry.F.has_value());  // Zeros.
  EXPECT_FALSE(results[0].geometry.E.has_value());
}

TEST_F(ShardResults, PosesThatAreNotSet) {
  // COLMAP 3.9 to 3.13 write the identity where no relative pose was asked for; COLMAP 4 would take
  // it for one. 3.8 writes zeros of either sign.
  const std::string one = "000000000000F03F";
  const std::string zero = "0000000000000000";
  const std::string negative = "0000000000000080";
  const auto pose = [&](const std::string& qvec, const std::string& tvec) {
    std::filesystem::remove(Path());
    Result("0, 2, NULL", "0, 2, NULL, 3, NULL, NULL, NULL, x'" + qvec + "', x'" + tvec + "'");
    return Read()[0].geometry.pose;
  };
  EXPECT_FALSE(pose(one + zero + zero + zero, zero + negative + zero).has_value());
  EXPECT_FALSE(pose(zero + negative + negative + negative, zero + zero + zero).has_value());
  const std::optional<RelativePose> moved = pose(one + zero + zero + zero, zero + one + zero);
  ASSERT_TRUE(moved.has_value());
  EXPECT_THAT(moved->translation, ElementsAre(0, 1, 0));
}

TEST_F(ShardResults, MissingPair) {
  CreateColmapDatabase(Path(), Schema::kColmap38);
  EXPECT_THAT(MessageOf([this] { Read(); }), HasSubstr("no result"));
}

TEST_F(ShardResults, MatchesOfFeaturesThatDoNotExist) {
  Result("1, 2, x'010000000A000000'", "0, 2, NULL, 0, NULL, NULL, NULL, NULL, NULL");
  EXPECT_THAT(MessageOf([this] { Read(); }), HasSubstr("features that the images do not have"));
}

TEST_F(ShardResults, BlobsOfTheWrongSize) {
  Result("2, 2, x'0100000001000000'", "0, 2, NULL, 0, NULL, NULL, NULL, NULL, NULL");
  EXPECT_THAT(MessageOf([this] { Read(); }), HasSubstr("wrong size"));
}

TEST_F(ShardResults, NumbersThatOverflow) {
  Result("2305843009213693952, 2, NULL", "0, 2, NULL, 0, NULL, NULL, NULL, NULL, NULL");
  EXPECT_THAT(MessageOf([this] { Read(); }), HasSubstr("wrong size"));
  Execute("UPDATE matches SET rows = 0");
  Execute("UPDATE two_view_geometries SET config = 4294967299");
  EXPECT_THAT(MessageOf([this] { Read(); }), HasSubstr("configuration 4294967299"));
}

TEST_F(ShardResults, MatricesOfTheWrongSize) {
  Result("0, 2, NULL", "0, 2, NULL, 0, zeroblob(71), NULL, NULL, NULL, NULL");
  EXPECT_THAT(MessageOf([this] { Read(); }), HasSubstr("matrix F of the wrong size"));
}

TEST_F(ShardResults, UnknownConfiguration) {
  Result("0, 2, NULL", "0, 2, NULL, 99, NULL, NULL, NULL, NULL, NULL");
  EXPECT_THAT(MessageOf([this] { Read(); }), HasSubstr("configuration 99"));
}

}  // namespace
}  // namespace colmap_graphmatch
