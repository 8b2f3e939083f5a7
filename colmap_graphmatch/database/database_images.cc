#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/database/rows.h"

namespace colmap_graphmatch {
namespace {

// Bytes of the longest path on Linux. Images are named by their paths.
constexpr std::size_t kMaxNameLength = 4096;

// COLMAP's keypoints with the most columns are affine frames.
constexpr std::size_t kMaxKeypointCols = 6;

// FeatureExtractorType::SIFT in COLMAP 4 (src/colmap/feature/types.h).
constexpr std::int64_t kSiftType = 0;

// More than any model has parameters.
constexpr std::size_t kMaxCameraBytes = 64 * sizeof(double);

std::int64_t NumBytes(sqlite::Connection& connection) {
  sqlite::Statement size(connection,
                         "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
  size.Step();
  return size.Int(0);
}

}  // namespace

std::vector<ImageRecord> Database::ReadImages() {
  // The lengths of blobs are in the rows' headers: this reads no descriptor. (The length of a text
  // would be its number of letters.)
  sqlite::Statement select(
      connection_,
      "SELECT images.image_id, images.name, descriptors.rows, descriptors.cols, "
      "iif(typeof(descriptors.data) = 'blob', length(descriptors.data), 0), keypoints.rows, "
      "keypoints.cols, iif(typeof(keypoints.data) = 'blob', length(keypoints.data), 0), " +
          std::string(descriptors_have_type_ ? "descriptors.type" : "0") +
          ", images.camera_id FROM images LEFT JOIN descriptors ON descriptors.image_id = "
          "images.image_id "
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
    image.camera_id = static_cast<CameraId>(select.Int(9));

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

void Database::CheckNumber(std::size_t num_rows, const ImageRecord& image) const {
  if (num_rows == image.num_features) return;
  throw DatabaseError("The features of image \"" + image.name + "\" (id " +
                      std::to_string(image.id) + ") in " + Path().string() +
                      " changed while they were read. Let the other program finish first.");
}

Descriptors Database::ReadDescriptors(const ImageRecord& image) {
  Descriptors descriptors = ReadDescriptors(image.id);
  CheckNumber(descriptors.num_rows, image);
  return descriptors;
}

Keypoints Database::ReadKeypoints(const ImageRecord& image) {
  Keypoints keypoints = ReadKeypoints(image.id);
  CheckNumber(keypoints.num_rows, image);
  if (keypoints.num_rows > 0 && keypoints.num_cols < 2) CheckNumber(0, image);
  return keypoints;
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

std::map<CameraId, Camera> Database::ReadCameras() {
  sqlite::Statement select(connection_,
                           "SELECT camera_id, model, width, height, params, " +
                               std::string(cameras_have_prior_ ? "prior_focal_length" : "0") +
                               " FROM cameras ORDER BY camera_id");
  const auto number = [&select](int column) {
    return static_cast<int>(
        std::clamp<std::int64_t>(select.Int(column), -1, std::numeric_limits<int>::max()));
  };
  std::map<CameraId, Camera> cameras;
  AscendingKeys ids;
  while (select.Step()) {
    if (!ids.Add(select.Int(0))) ThrowDamaged("the ids of its cameras do not ascend");
    Camera camera;
    camera.id = static_cast<CameraId>(select.Int(0));
    camera.model_id = number(1);
    camera.width = number(2);
    camera.height = number(3);
    // A part of a number is none: the count is then a wrong one.
    camera.params.resize(std::min(select.Size(4), kMaxCameraBytes) / sizeof(double));
    if (!camera.params.empty()) {
      std::memcpy(camera.params.data(), select.Data(4), camera.params.size() * sizeof(double));
    }
    camera.has_prior_focal_length = select.Int(5) != 0;
    cameras.emplace(camera.id, std::move(camera));
  }
  return cameras;
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

}  // namespace colmap_graphmatch
