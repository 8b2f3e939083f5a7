#include "tests/support/synthetic_database.h"

#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): mkdtemp is POSIX, not in <cstdlib>.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "colmap_graphmatch/base/random.h"

namespace colmap_graphmatch {
namespace {

// A SIFT descriptor in bytes has a length of about 512.
constexpr double kDescriptorLength = 512;

void CreateTables(sqlite::Connection* database, Schema schema) {
  const bool is38 = schema == Schema::kColmap38;
  const bool is42 = schema == Schema::kColmap42;
  database->Execute("PRAGMA journal_mode = WAL");
  database->Execute(std::string("PRAGMA user_version = ") + (is38   ? "3800"
                                                             : is42 ? "4020100"
                                                                    : "3900"));
  if (is42) {
    database->Execute(
        "CREATE TABLE rigs(rig_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, "
        "ref_sensor_id INTEGER NOT NULL, ref_sensor_type INTEGER NOT NULL)");
    database->Execute(
        "CREATE TABLE frames(frame_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, "
        "rig_id INTEGER NOT NULL, FOREIGN KEY(rig_id) REFERENCES rigs(rig_id) ON DELETE CASCADE)");
    database->Execute(
        "CREATE TABLE frame_data(frame_id INTEGER NOT NULL, data_id INTEGER NOT NULL, sensor_id "
        "INTEGER NOT NULL, sensor_type INTEGER NOT NULL, FOREIGN KEY(frame_id) REFERENCES "
        "frames(frame_id) ON DELETE CASCADE)");
  }
  database->Execute(
      "CREATE TABLE cameras(camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, model INTEGER "
      "NOT NULL, width INTEGER NOT NULL, height INTEGER NOT NULL, params BLOB, prior_focal_length "
      "INTEGER NOT NULL)");
  database->Execute(
      std::string("CREATE TABLE images(image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name "
                  "TEXT NOT NULL UNIQUE, camera_id INTEGER NOT NULL, ") +
      (is38 ? "prior_qw REAL, prior_qx REAL, prior_qy REAL, prior_qz REAL, prior_tx REAL, prior_ty "
              "REAL, prior_tz REAL, "
            : "") +
      "CONSTRAINT image_id_check CHECK(image_id >= 0 and image_id < 2147483647), FOREIGN "
      "KEY(camera_id) REFERENCES cameras(camera_id))");
  database->Execute("CREATE UNIQUE INDEX index_name ON images(name)");
  const std::string of_image =
      ", FOREIGN KEY(image_id) REFERENCES images(image_id) ON DELETE CASCADE)";
  const std::string matrix = "rows INTEGER NOT NULL, cols INTEGER NOT NULL, data BLOB";
  database->Execute("CREATE TABLE keypoints(image_id INTEGER PRIMARY KEY NOT NULL, " + matrix +
                    of_image);
  database->Execute("CREATE TABLE descriptors(image_id INTEGER PRIMARY KEY NOT NULL, " +
                    std::string(is42 ? "type INTEGER NOT NULL, " : "") + matrix + of_image);
  database->Execute("CREATE TABLE matches(pair_id INTEGER PRIMARY KEY NOT NULL, " + matrix + ")");
  database->Execute("CREATE TABLE two_view_geometries(pair_id INTEGER PRIMARY KEY NOT NULL, " +
                    matrix +
                    ", config INTEGER NOT NULL, F BLOB, E BLOB, H BLOB, qvec BLOB, tvec BLOB" +
                    (is42 ? ", camera1 BLOB, camera2 BLOB)" : ")"));
}

sqlite::Blob Bytes(const void* data, std::size_t size) {
  sqlite::Blob blob(size);
  if (size > 0) std::memcpy(blob.data(), data, size);
  return blob;
}

}  // namespace

sqlite::Connection CreateColmapDatabase(const std::filesystem::path& path, Schema schema) {
  std::ofstream(path).close();
  sqlite::Connection database(path, sqlite::Access::kReadWrite, 10);
  CreateTables(&database, schema);
  return database;
}

void WriteSyntheticDatabase(const std::filesystem::path& path, Schema schema,
                            const std::vector<SyntheticImage>& images) {
  sqlite::Connection database = CreateColmapDatabase(path, schema);
  sqlite::Transaction transaction(database);
  const double params[] = {900, 400, 300, 0};
  sqlite::Statement camera(database, "INSERT INTO cameras VALUES(1, 2, 800, 600, ?1, 0)");
  const sqlite::Blob params_blob = Bytes(params, sizeof(params));
  camera.Bind(1, params_blob).Run();

  sqlite::Statement insert_image(database,
                                 "INSERT INTO images(image_id, name, camera_id) VALUES(?1, ?2, 1)");
  sqlite::Statement insert_keypoints(
      database, "INSERT INTO keypoints(image_id, rows, cols, data) VALUES(?1, ?2, ?3, ?4)");
  sqlite::Statement insert_descriptors(
      database,
      schema == Schema::kColmap42
          ? "INSERT INTO descriptors(image_id, type, rows, cols, data) "
            "VALUES(?1, 0, ?2, 128, ?3)"
          : "INSERT INTO descriptors(image_id, rows, cols, data) VALUES(?1, ?2, 128, ?3)");
  std::int64_t id = 0;
  if (schema == Schema::kColmap42) database.Execute("INSERT INTO rigs VALUES(1, 1, 0)");
  for (const SyntheticImage& image : images) {
    ++id;
    if (schema == Schema::kColmap42) {
      // As COLMAP does where no rig is known: a frame for every image.
      const std::string text = std::to_string(id);
      database.Execute("INSERT INTO frames VALUES(" + text + ", 1)");
      database.Execute("INSERT INTO frame_data VALUES(" + text + ", " + text + ", 1, 0)");
    }
    Keypoints keypoints = image.keypoints;
    if (keypoints.data.empty()) {
      keypoints.num_rows = image.descriptors.num_rows;
      keypoints.num_cols = 4;
      // Everywhere, and at the same place in every image: matches are inliers of one homography.
      for (std::size_t row = 0; row < keypoints.num_rows; ++row) {
        const auto value = static_cast<float>(row);
        keypoints.data.insert(keypoints.data.end(),
                              {200 + static_cast<float>(row * 173 % 401),
                               150 + static_cast<float>(row * 97 % 307), 1 + value / 10, 0});
      }
    }
    insert_image.Bind(1, id).Bind(2, image.name).Run();
    const sqlite::Blob data = Bytes(keypoints.data.data(), keypoints.data.size() * sizeof(float));
    insert_keypoints.Bind(1, id)
        .Bind(2, static_cast<std::int64_t>(keypoints.num_rows))
        .Bind(3, static_cast<std::int64_t>(keypoints.num_cols))
        .Bind(4, data)
        .Run();
    insert_descriptors.Bind(1, id)
        .Bind(2, static_cast<std::int64_t>(image.descriptors.num_rows))
        .Bind(3, image.descriptors.data)
        .Run();
  }
  transaction.Commit();
}

std::vector<SyntheticImage> MakePlaces(int num_places, int photos_a_place, int num_features,
                                       std::uint64_t seed) {
  Random random({seed});
  std::vector<SyntheticImage> images;
  for (int place = 0; place < num_places; ++place) {
    std::vector<std::vector<double>> features(static_cast<std::size_t>(num_features));
    for (std::vector<double>& feature : features) {
      feature.resize(kDescriptorDim);
      // Sparse and non-negative, like histograms of gradients.
      for (double& value : feature) value = std::max(0.0, random.Uniform() - 0.6);
    }
    for (int photo = 0; photo < photos_a_place; ++photo) {
      SyntheticImage image;
      image.name = "place" + std::to_string(place) + "/photo " + std::to_string(photo) + ".jpg";
      image.descriptors.num_rows = features.size();
      for (const std::vector<double>& feature : features) {
        std::vector<double> noisy;
        double norm = 0;
        for (const double value : feature) {
          noisy.push_back(std::max(0.0, value + 0.05 * (random.Uniform() - 0.5)));
          norm += noisy.back() * noisy.back();
        }
        for (const double value : noisy) {
          const double byte = kDescriptorLength * value / std::sqrt(norm);
          image.descriptors.data.push_back(static_cast<std::uint8_t>(std::min(255.0, byte + 0.5)));
        }
      }
      images.push_back(std::move(image));
    }
  }
  return images;
}

TestDirectory::TestDirectory() {
  std::string name = (std::filesystem::temp_directory_path() / "graphmatch test-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make " + name);
  path_ = name;
}

TestDirectory::~TestDirectory() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace colmap_graphmatch
