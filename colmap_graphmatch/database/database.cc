#include "colmap_graphmatch/database/database.h"

#include <algorithm>
#include <boost/crc.hpp>
#include <cmath>
#include <cstring>
#include <iterator>
#include <map>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

// The first schema in which an unset matrix is NULL and zeros would count as set (COLMAP 3.9).
constexpr std::int64_t kFirstVersionWithNull = 3900;

// Of kGeometryColumns.
constexpr std::size_t kQvecColumn = 3;
constexpr std::size_t kTvecColumn = 4;

// Bytes of the longest path on Linux. Images are named by their paths.
constexpr std::size_t kMaxNameLength = 4096;

// COLMAP's keypoints with the most columns are affine frames.
constexpr std::size_t kMaxKeypointCols = 6;

// FeatureExtractorType::SIFT in COLMAP 4 (src/colmap/feature/types.h).
constexpr std::int64_t kSiftType = 0;

const std::filesystem::path& ExistingFile(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (error == std::errc::permission_denied) {
    throw DatabaseError("You may not look at " + path.string() +
                        ": permission denied. Run this as its owner, or copy the database.");
  }
  if (!std::filesystem::exists(status)) {
    throw DatabaseError("There is no database at " + path.string() +
                        ". Make one with `colmap feature_extractor --database_path " +
                        path.string() + " --image_path IMAGES`.");
  }
  if (std::filesystem::is_directory(status)) {
    throw DatabaseError(path.string() + " is a directory. Give the path of the database.db in it.");
  }
  if (std::filesystem::is_regular_file(status) && std::filesystem::file_size(path, error) == 0 &&
      !error) {
    throw DatabaseError(path.string() +
                        " is an empty file. Run `colmap feature_extractor` on it first.");
  }
  return path;
}

bool Contains(const std::vector<std::string>& values, const std::string& value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

std::string Join(const std::vector<std::string>& values) {
  std::string joined;
  for (const std::string& value : values) {
    if (!joined.empty()) joined += ", ";
    joined += value;
  }
  return joined;
}

std::vector<double> Doubles(const sqlite::Blob& blob) {
  std::vector<double> values(blob.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), blob.data(), values.size() * sizeof(double));
  return values;
}

// Of either sign: COLMAP 3.8 inverts an unset pose to negative zeros.
bool AllZero(const sqlite::Blob& blob) {
  const std::vector<double> values = Doubles(blob);
  return std::all_of(values.begin(), values.end(), [](double value) { return value == 0; });
}

// COLMAP 3.9 to 3.13 write the identity for an unset pose.
bool IsIdentity(const sqlite::Blob& qvec, const sqlite::Blob& tvec) {
  return Doubles(qvec) == std::vector<double>{1, 0, 0, 0} && AllZero(tvec);
}

// False for keys that COLMAP never writes, e.g. with the larger id first: they name no pair.
bool IsColmapsKey(PairId pair_id) {
  const ImagePair pair = DecodePair(pair_id);
  return pair.id1 != 0 && pair.id1 != pair.id2 && EncodePair(pair) == pair_id;
}

// Notices a table whose rows do not come in the order of their keys: in a damaged file, the same
// rows can come again and again, without end.
class AscendingKeys {
 public:
  // False if the key is not greater than the one before.
  bool Add(std::int64_t key) {
    const bool ascends = first_ || key > last_;
    first_ = false;
    last_ = key;
    return ascends;
  }

 private:
  bool first_ = true;
  std::int64_t last_ = 0;
};

std::int64_t NumBytes(sqlite::Connection& connection) {
  sqlite::Statement size(connection,
                         "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
  size.Step();
  return size.Int(0);
}

// True if SQLite would compute something when it writes a row into the table: generated columns,
// defaults that are expressions, partial indexes and those on expressions. Any of them can take for
// ever, and COLMAP's tables have none. (CHECK constraints are off: see sqlite.h.)
bool ComputesOnWriting(sqlite::Connection& connection, const std::string& table) {
  sqlite::Statement computed(
      connection,
      "SELECT EXISTS(SELECT 1 FROM pragma_table_xinfo(?1, 'main') "
      "WHERE hidden <> 0 OR instr(dflt_value, '(') > 0) "
      "OR EXISTS(SELECT 1 FROM pragma_index_list(?1, 'main') AS list WHERE list.partial <> 0 "
      "OR EXISTS(SELECT 1 FROM pragma_index_xinfo(list.name, 'main') WHERE cid = -2))");
  computed.Bind(1, table).Step();
  return computed.Int(0) != 0;
}

}  // namespace

float Keypoints::Scale(std::size_t row) const {
  const float* keypoint = data.data() + row * num_cols;
  switch (num_cols) {
    case 4:
      return keypoint[2];
    case 6:
      return (std::hypot(keypoint[2], keypoint[4]) + std::hypot(keypoint[3], keypoint[5])) / 2;
    default:
      return 0;
  }
}

std::vector<float> Keypoints::Scales(std::size_t num) const {
  std::vector<float> scales(num);
  for (std::size_t row = 0; row < std::min(num, num_rows); ++row) scales[row] = Scale(row);
  return scales;
}

std::vector<std::uint8_t> Descriptors::CopyRows(const std::vector<std::size_t>& rows) const {
  std::vector<std::uint8_t> copy;
  copy.reserve(rows.size() * kDescriptorDim);
  for (const std::size_t row : rows) copy.insert(copy.end(), Row(row), Row(row) + kDescriptorDim);
  return copy;
}

bool IsEdge(std::size_t num_inliers, int config, std::size_t min_num_inliers) {
  return num_inliers >= std::max<std::size_t>(1, min_num_inliers) && config > 1 && config != 7;
}

Database::Database(const std::filesystem::path& path, sqlite::Access access,
                   const sqlite::LockPatience& patience)
    : connection_(ExistingFile(path), access, patience) {
  CheckSchema();
}

void Database::ThrowNotColmaps(const std::string& problem) const {
  throw DatabaseError(Path().string() + " is not a database of COLMAP 3.8 or later: " + problem +
                      ". Give the database.db that `colmap feature_extractor` wrote.");
}

void Database::ThrowDamaged(const std::string& problem) const {
  throw DatabaseError(Path().string() + " is damaged: " + problem +
                      ". `sqlite3 FILE .recover` may save its contents.");
}

void Database::CheckSchema() {
  // The first column is the key.
  const std::map<std::string, std::vector<std::string>> needed = {
      {"cameras", {"camera_id", "model", "width", "height", "params"}},
      {"images", {"image_id", "name", "camera_id"}},
      {"keypoints", {"image_id", "rows", "cols", "data"}},
      {"descriptors", {"image_id", "rows", "cols", "data"}},
      {"matches", {"pair_id", "rows", "cols", "data"}},
      {"two_view_geometries", {"pair_id", "rows", "cols", "data", "config", "F", "E", "H"}}};
  // Views and virtual tables have no page of their own.
  sqlite::Statement find_table(connection_,
                               "SELECT rootpage FROM main.sqlite_schema WHERE type IN "
                               "('table', 'view') AND name = ?1 COLLATE NOCASE");
  // A key of several columns, or one that is not the rowid, has an index.
  sqlite::Statement find_key(connection_,
                             "SELECT 1 FROM pragma_table_info(?1, 'main') WHERE name = ?2 AND "
                             "pk = 1 AND NOT EXISTS(SELECT 1 FROM pragma_index_list(?1, 'main') "
                             "WHERE origin = 'pk')");
  for (const auto& [table, columns] : needed) {
    if (!find_table.Bind(1, table).Step()) ThrowNotColmaps("it has no table " + table);
    if (find_table.IsNull(0) || find_table.Int(0) == 0) {
      ThrowNotColmaps("its " + table + " is a view or a virtual table");
    }
    find_table.Reset();
    const std::vector<std::string> existing = connection_.Columns(table);
    for (const std::string& column : columns) {
      if (Contains(existing, column)) continue;
      ThrowNotColmaps("its table " + table + " has no column " + column);
    }
    if (!find_key.Bind(1, table).Bind(2, columns.front()).Step()) {
      ThrowNotColmaps("its table " + table + " has not " + columns.front() +
                      " as its INTEGER PRIMARY KEY");
    }
    find_key.Reset();
  }
  for (const char* table : {"matches", "two_view_geometries"}) {
    if (!ComputesOnWriting(connection_, table)) continue;
    ThrowNotColmaps(std::string("its table ") + table +
                    " has generated columns, computed defaults, or indexes that are partial or on "
                    "expressions");
  }
  const std::vector<std::string> existing = connection_.Columns("two_view_geometries");
  for (std::size_t i = 0; i < kGeometryColumns.size(); ++i) {
    if (Contains(existing, kGeometryColumns[i])) geometry_columns_.push_back(i);
  }
  descriptors_have_type_ = Contains(connection_.Columns("descriptors"), "type");

  sqlite::Statement version(connection_, "PRAGMA user_version");
  version.Step();
  unset_is_null_ = version.Int(0) >= kFirstVersionWithNull;
}

std::vector<ImageRecord> Database::ReadImages() {
  // The lengths of blobs are in the rows' headers: this reads no descriptor. (The length of a text
  // would be its number of letters.)
  sqlite::Statement select(
      connection_,
      "SELECT images.image_id, images.name, descriptors.rows, descriptors.cols, "
      "iif(typeof(descriptors.data) = 'blob', length(descriptors.data), 0), keypoints.rows, "
      "keypoints.cols, iif(typeof(keypoints.data) = 'blob', length(keypoints.data), 0), " +
          std::string(descriptors_have_type_ ? "descriptors.type" : "0") +
          " FROM images LEFT JOIN descriptors ON descriptors.image_id = images.image_id "
          "LEFT JOIN keypoints ON keypoints.image_id = images.image_id ORDER BY images.image_id");
  std::vector<ImageRecord> images;
  bool any_features = false;
  AscendingKeys ids;
  std::int64_t num_bytes_left = 0;
  while (select.Step()) {
    // Asked for within the transaction that the first row began: the file may be growing.
    if (images.empty()) num_bytes_left = NumBytes(connection_);
    const std::int64_t id = select.Int(0);
    const std::int64_t rows = select.Int(2);
    const std::int64_t cols = select.Int(3);
    const std::int64_t size = select.Int(4);
    const std::int64_t keypoint_rows = select.Int(5);
    const std::int64_t keypoint_cols = select.Int(6);
    const std::int64_t keypoint_size = select.Int(7);

    ImageRecord image;
    image.name = select.Text(1);
    // In a damaged file, parts of it can be in many rows at once, without end.
    if (!ids.Add(id)) ThrowDamaged("the ids of its images do not ascend");
    if (image.name.size() > kMaxNameLength) {
      ThrowDamaged("the name of the image with id " + std::to_string(id) + " has " +
                   std::to_string(image.name.size()) + " bytes, more than any path");
    }
    num_bytes_left -= static_cast<std::int64_t>(image.name.size()) + size + keypoint_size;
    if (num_bytes_left < 0) ThrowDamaged("its images are larger than the file");
    const auto fail = [&](const std::string& problem) {
      throw DatabaseError("Image \"" + image.name + "\" (id " + std::to_string(id) + ") in " +
                          Path().string() + ": " + problem +
                          " Delete the image's rows or extract its features again.");
    };
    if (id < 1 || static_cast<PairId>(id) >= kMaxNumImages) {
      fail("the id is outside COLMAP's range of 1 to 2147483646.");
    }
    image.id = static_cast<ImageId>(id);

    if (!select.IsNull(2) && rows != 0) {
      const std::string shape = std::to_string(rows) + " x " + std::to_string(cols);
      if (select.Int(8) != kSiftType || (rows > 0 && cols > 0 && size / rows / cols == 4)) {
        fail("its descriptors (" + shape +
             ") are not SIFT descriptors of one byte an entry; ALIKED and other floating-point "
             "features cannot be matched by this program.");
      }
      if (cols != kDescriptorDim) {
        fail("its descriptors are " + shape + "; SIFT descriptors have 128 columns.");
      }
      // Before the product, which a corrupt number of rows could overflow.
      if (rows < 0 || rows > size || rows * cols != size) {
        fail("its descriptors are said to be " + shape + " bytes, but the blob has " +
             std::to_string(size) + ".");
      }
      if (keypoint_rows != rows) {
        fail("it has " + std::to_string(rows) + " descriptors but " +
             std::to_string(keypoint_rows) + " keypoints.");
      }
      if (keypoint_cols != 2 && keypoint_cols != 4 && keypoint_cols != 6) {
        fail("its keypoints have " + std::to_string(keypoint_cols) +
             " columns; COLMAP stores 2, 4 or 6.");
      }
      if (keypoint_rows * keypoint_cols * 4 != keypoint_size) {
        fail("its keypoints are said to be " + std::to_string(keypoint_rows) + " x " +
             std::to_string(keypoint_cols) + " floats, but the blob has " +
             std::to_string(keypoint_size) + " bytes.");
      }
      image.num_features = static_cast<std::size_t>(rows);
      any_features = true;
    }
    images.push_back(std::move(image));
  }
  if (images.empty()) {
    throw DatabaseError(Path().string() +
                        " has no images. Run `colmap feature_extractor` on it first.");
  }
  if (!any_features) {
    throw DatabaseError("None of the " + std::to_string(images.size()) + " images in " +
                        Path().string() +
                        " has features. Run `colmap feature_extractor` on it first.");
  }
  return images;
}

std::vector<ImageRecord> WithFeatures(const std::vector<ImageRecord>& images) {
  std::vector<ImageRecord> with_features;
  std::copy_if(images.begin(), images.end(), std::back_inserter(with_features),
               [](const ImageRecord& image) { return image.num_features > 0; });
  return with_features;
}

Descriptors Database::ReadDescriptors(ImageId image_id) {
  sqlite::Statement select(connection_, "SELECT rows, data FROM descriptors WHERE image_id = ?1");
  select.Bind(1, std::int64_t{image_id});
  Descriptors descriptors;
  if (!select.Step()) return descriptors;
  descriptors.num_rows = static_cast<std::size_t>(select.Int(0));
  descriptors.data = select.CopyBlob(1);
  // Divided, not multiplied: a nonsensical number of rows must not overflow into a right one.
  if (descriptors.data.size() % kDescriptorDim != 0 ||
      descriptors.data.size() / kDescriptorDim != descriptors.num_rows) {
    throw DatabaseError("The descriptors of the image with id " + std::to_string(image_id) +
                        " in " + Path().string() +
                        " changed while they were read. Is another program writing "
                        "to the database?");
  }
  return descriptors;
}

Descriptors Database::ReadDescriptors(const ImageRecord& image) {
  Descriptors descriptors = ReadDescriptors(image.id);
  if (descriptors.num_rows != image.num_features) {
    throw DatabaseError("The features of image \"" + image.name + "\" (id " +
                        std::to_string(image.id) + ") in " + Path().string() +
                        " changed while they were read. Let the other program finish first.");
  }
  return descriptors;
}

Keypoints Database::ReadKeypoints(ImageId image_id) {
  sqlite::Statement select(connection_,
                           "SELECT rows, cols, data FROM keypoints WHERE image_id = ?1");
  select.Bind(1, std::int64_t{image_id});
  Keypoints keypoints;
  if (!select.Step()) return keypoints;
  keypoints.num_rows = static_cast<std::size_t>(select.Int(0));
  keypoints.num_cols = static_cast<std::size_t>(select.Int(1));
  const std::size_t size = select.Size(2);
  const std::size_t row_size = keypoints.num_cols * sizeof(float);
  if (keypoints.num_cols > kMaxKeypointCols || keypoints.num_rows > size ||
      keypoints.num_rows * row_size != size) {
    throw DatabaseError("The keypoints of the image with id " + std::to_string(image_id) + " in " +
                        Path().string() +
                        " changed while they were read. Is another program writing "
                        "to the database?");
  }
  keypoints.data.resize(size / sizeof(float));
  if (size > 0) std::memcpy(keypoints.data.data(), select.Data(2), size);
  return keypoints;
}

std::vector<ImageFingerprint> Database::ReadFingerprints(const std::vector<ImageRecord>& images) {
  // About what is on the pages of the rows themselves: the rest of a blob is elsewhere in the file.
  constexpr std::size_t kNumBytes = 2048;
  sqlite::BlobPrefixReader descriptors(connection_, "descriptors", "data");
  sqlite::BlobPrefixReader keypoints(connection_, "keypoints", "data");
  std::vector<ImageFingerprint> fingerprints;
  for (const ImageRecord& image : images) {
    if (image.num_features == 0) continue;
    boost::crc_32_type crc;
    for (sqlite::BlobPrefixReader* reader : {&descriptors, &keypoints}) {
      const sqlite::Blob bytes = reader->Read(image.id, kNumBytes);
      crc.process_bytes(bytes.data(), bytes.size());
    }
    fingerprints.push_back({image.id, static_cast<std::int64_t>(crc.checksum()) << 31 ^
                                          static_cast<std::int64_t>(image.num_features)});
  }
  return fingerprints;
}

std::map<ImageId, std::uint32_t> Database::ReadFrames() {
  std::map<ImageId, std::uint32_t> frames;
  // Without what is computed when it is read.
  const std::vector<std::string> columns = connection_.Columns("frame_data");
  if (columns.empty()) return frames;
  for (const char* column : {"data_id", "frame_id", "sensor_type"}) {
    if (!Contains(columns, column)) {
      ThrowNotColmaps(std::string("its table frame_data has no column ") + column);
    }
  }
  // SensorType::CAMERA in COLMAP (src/colmap/util/types.h) is 0.
  sqlite::Statement select(connection_,
                           "SELECT data_id, frame_id, rowid FROM frame_data WHERE sensor_type = 0 "
                           "ORDER BY rowid");
  AscendingKeys keys;
  while (select.Step()) {
    if (!keys.Add(select.Int(2))) ThrowDamaged("the rows of frame_data do not ascend");
    frames[static_cast<ImageId>(select.Int(0))] = static_cast<std::uint32_t>(select.Int(1));
  }
  return frames;
}

std::vector<TestedPair> Database::ReadTestedPairs() {
  sqlite::Statement select(
      connection_, "SELECT pair_id, rows, config FROM two_view_geometries ORDER BY pair_id");
  std::vector<TestedPair> tested;
  AscendingKeys keys;
  while (select.Step()) {
    TestedPair pair;
    if (!keys.Add(select.Int(0))) ThrowDamaged("the keys of two_view_geometries do not ascend");
    const auto pair_id = static_cast<PairId>(select.Int(0));
    if (!IsColmapsKey(pair_id)) continue;
    pair.pair = DecodePair(pair_id);
    pair.num_inliers = static_cast<std::size_t>(std::max<std::int64_t>(0, select.Int(1)));
    pair.config = static_cast<int>(select.Int(2));
    tested.push_back(pair);
  }
  return tested;
}

std::vector<VerifiedPair> Database::ReadVerifiedPairs(std::size_t min_num_inliers) {
  std::vector<VerifiedPair> pairs;
  for (const TestedPair& tested : ReadTestedPairs()) {
    const bool is_edge = IsEdge(tested.num_inliers, tested.config, min_num_inliers);
    VerifiedPair verified;
    verified.pair = tested.pair;
    verified.outcome = is_edge ? PairOutcome::kEdge : PairOutcome::kNoEdge;
    verified.num_inliers = static_cast<std::uint32_t>(tested.num_inliers);
    verified.is_known = true;
    pairs.push_back(verified);
  }
  return pairs;
}

std::unordered_map<ImagePair, std::size_t> Database::ReadNumMatches() {
  sqlite::Statement select(connection_, "SELECT pair_id, rows FROM matches ORDER BY pair_id");
  std::unordered_map<ImagePair, std::size_t> num_matches;
  AscendingKeys keys;
  while (select.Step()) {
    if (!keys.Add(select.Int(0))) ThrowDamaged("the keys of matches do not ascend");
    const auto pair_id = static_cast<PairId>(select.Int(0));
    if (!IsColmapsKey(pair_id)) continue;
    num_matches[DecodePair(pair_id)] =
        static_cast<std::size_t>(std::max<std::int64_t>(0, select.Int(1)));
  }
  return num_matches;
}

std::vector<ImagePair> Database::ReadUnverifiedPairs() {
  // Every row is looked at here, not by SQLite, so that rows without end are noticed.
  sqlite::Statement select(connection_,
                           "SELECT pair_id, pair_id NOT IN (SELECT pair_id FROM "
                           "two_view_geometries) FROM matches ORDER BY pair_id");
  std::vector<ImagePair> pairs;
  AscendingKeys keys;
  while (select.Step()) {
    if (!keys.Add(select.Int(0))) ThrowDamaged("the keys of matches do not ascend");
    const auto pair_id = static_cast<PairId>(select.Int(0));
    if (select.Int(1) != 0 && IsColmapsKey(pair_id)) pairs.push_back(DecodePair(pair_id));
  }
  return pairs;
}

void Database::ExpectFeatures(const std::vector<ImageRecord>& images,
                              const std::vector<ImageFingerprint>& fingerprints) {
  expected_.clear();
  for (const ImageFingerprint& fingerprint : fingerprints) {
    expected_[fingerprint.id].features = fingerprint.features;
  }
  for (const ImageRecord& image : images) {
    const auto expected = expected_.find(image.id);
    if (expected != expected_.end()) expected->second.image = image;
  }
}

bool Database::HasFeatures(const ImageRecord& image, std::int64_t features) {
  // Their number is part of the fingerprint: as it is now. Without blobs there is none.
  sqlite::Statement select(
      connection_,
      "SELECT descriptors.rows FROM descriptors JOIN keypoints USING(image_id) WHERE image_id = ?1 "
      "AND typeof(descriptors.data) = 'blob' AND typeof(keypoints.data) = 'blob'");
  if (!select.Bind(1, std::int64_t{image.id}).Step()) return false;
  ImageRecord now = image;
  now.num_features = static_cast<std::size_t>(std::max<std::int64_t>(0, select.Int(0)));
  const std::vector<ImageFingerprint> found = ReadFingerprints({now});
  return !found.empty() && found.front().features == features;
}

void Database::CheckFeatures(const std::vector<PairRows>& pairs) {
  if (expected_.empty()) return;
  const std::int64_t version = connection_.DataVersion();
  std::vector<ImageRecord> unseen;
  for (const PairRows& rows : pairs) {
    for (const ImageId id : {rows.pair.id1, rows.pair.id2}) {
      ExpectedFeatures& expected = expected_.at(id);
      if (expected.seen_in == version) continue;
      expected.seen_in = version;
      unseen.push_back(expected.image);
    }
  }
  for (const ImageRecord& image : unseen) {
    if (HasFeatures(image, expected_.at(image.id).features)) continue;
    throw DatabaseError("The features of image \"" + image.name + "\" (id " +
                        std::to_string(image.id) + ") in " + Path().string() +
                        " changed during the run. Pairs of its old features are not written. Let "
                        "the other program finish, then run the same command again.");
  }
}

void Database::CheckWritable() { const sqlite::Transaction rolled_back(connection_); }

void Database::CheckInPlace() {
  if (!connection_.HasMoved()) return;
  throw DatabaseError(Path().string() +
                      " was moved, deleted or replaced by another file during the run. What was "
                      "verified since then went with the old file. Run the same command again.");
}

std::vector<TestedPair> Database::WritePairs(const std::vector<PairRows>& pairs) {
  CheckInPlace();
  if (!pages_are_checked_) {
    for (const char* table : {"matches", "two_view_geometries"}) connection_.CheckPages(table);
    pages_are_checked_ = true;
  }
  connection_.FinishWrites();
  std::vector<std::string> columns = {"pair_id", "rows", "cols", "data", "config"};
  std::string parameters = "?1, ?2, ?3, ?4, ?5";
  for (const std::size_t i : geometry_columns_) {
    columns.emplace_back(kGeometryColumns[i]);
    parameters += ", ?" + std::to_string(columns.size());
  }
  sqlite::Transaction transaction(connection_);
  CheckFeatures(pairs);
  sqlite::Statement select_other(connection_,
                                 "SELECT rows, config FROM two_view_geometries WHERE pair_id = ?1");
  std::vector<TestedPair> of_others;
  sqlite::Statement insert_matches(
      connection_,
      "INSERT OR REPLACE INTO matches(pair_id, rows, cols, data) VALUES(?1, ?2, ?3, ?4)");
  sqlite::Statement insert_geometry(
      connection_,
      "INSERT INTO two_view_geometries(" + Join(columns) + ") VALUES(" + parameters + ")");
  for (const PairRows& pair : pairs) {
    const auto pair_id = static_cast<std::int64_t>(EncodePair(pair.pair));
    const bool tested_by_others = select_other.Bind(1, pair_id).Step();
    if (tested_by_others) {
      of_others.push_back({pair.pair,
                           static_cast<std::size_t>(std::max<std::int64_t>(0, select_other.Int(0))),
                           static_cast<int>(select_other.Int(1))});
    }
    select_other.Reset();
    if (tested_by_others) continue;

    insert_matches.Bind(1, pair_id)
        .Bind(2, static_cast<std::int64_t>(pair.num_matches))
        .Bind(3, std::int64_t{2})
        .Bind(4, pair.matches)
        .Run();

    insert_geometry.Bind(1, pair_id)
        .Bind(2, static_cast<std::int64_t>(pair.num_inliers))
        .Bind(3, std::int64_t{2})
        .Bind(4, pair.inliers)
        .Bind(5, std::int64_t{pair.config});
    // Vectors of zeros for databases of COLMAP 3.8, whose reader expects a matrix wherever there
    // are inliers: qvec has 4 doubles, tvec 3, the matrices 9.
    static const sqlite::Blob kZeros9(72), kZeros4(32), kZeros3(24);
    const auto is_unset = [&pair](std::size_t i) {
      return !pair.geometry[i].has_value() || AllZero(*pair.geometry[i]);
    };
    const bool pose_is_unset = is_unset(kQvecColumn) || !pair.geometry[kTvecColumn].has_value() ||
                               IsIdentity(*pair.geometry[kQvecColumn], *pair.geometry[kTvecColumn]);
    int parameter = 6;
    for (const std::size_t i : geometry_columns_) {
      const std::optional<sqlite::Blob>& value = pair.geometry[i];
      // A pose is set as a whole: no rotation is all zeros, but a translation can be.
      const bool unset = i == kQvecColumn || i == kTvecColumn ? pose_is_unset : is_unset(i);
      if (!unset) {
        insert_geometry.Bind(parameter, *value);
      } else if (unset_is_null_ || pair.num_inliers == 0) {
        insert_geometry.BindNull(parameter);
      } else {
        insert_geometry.Bind(parameter, i == kQvecColumn   ? kZeros4
                                        : i == kTvecColumn ? kZeros3
                                                           : kZeros9);
      }
      ++parameter;
    }
    insert_geometry.Run();
  }
  transaction.Commit();
  CheckInPlace();
  return of_others;
}

}  // namespace colmap_graphmatch
