#include "colmap_graphmatch/database/two_view_geometry_codec.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

// What the first columns are: rows, cols, data, config.
constexpr std::size_t kNumFixedColumns = 4;

// COLMAP's columns after them, in any version.
constexpr std::array<const char*, 7> kValueColumns = {"F",    "E",       "H",      "qvec",
                                                      "tvec", "camera1", "camera2"};

// Zeros that stand for what is not set, of the largest size.
constexpr Matrix3 kZeros = {};

template <std::size_t N>
bool AllZero(const std::array<double, N>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return value == 0; });
}

// False if it is NULL.
template <std::size_t N>
bool ReadDoubles(const sqlite::Statement& row, int column, const std::string& name,
                 std::array<double, N>* values) {
  if (row.IsNull(column)) return false;
  if (row.Size(column) != sizeof(*values)) {
    throw DatabaseError("a matrix " + name + " of the wrong size");
  }
  std::memcpy(values->data(), row.Data(column), sizeof(*values));
  return true;
}

std::optional<Matrix3> ReadMatrix(const sqlite::Statement& row, int column,
                                  const std::string& name) {
  Matrix3 matrix;
  const bool is_set = ReadDoubles(row, column, name, &matrix) && !AllZero(matrix);
  return is_set ? std::make_optional(matrix) : std::nullopt;
}

// A pose is set as a whole: no rotation is all zeros, but a translation can be.
std::optional<RelativePose> PoseOf(const std::optional<std::array<double, 4>>& rotation,
                                   const std::optional<std::array<double, 3>>& translation) {
  if (!rotation || !translation || AllZero(*rotation)) return std::nullopt;
  const bool is_identity = *rotation == std::array<double, 4>{1, 0, 0, 0} && AllZero(*translation);
  if (is_identity) return std::nullopt;
  return RelativePose{*rotation, *translation};
}

}  // namespace

FeatureMatches DecodeMatches(const sqlite::Statement& row, int rows_column,
                             std::size_t num_features1, std::size_t num_features2) {
  const std::int64_t rows = row.Int(rows_column);
  const int data_column = rows_column + 2;
  const std::uint8_t* data = row.Data(data_column);
  const std::size_t size = row.Size(data_column);
  // Divided, not multiplied: a nonsensical number of rows must not overflow into a right one.
  if (rows < 0 || size % sizeof(FeatureMatch) != 0 ||
      size / sizeof(FeatureMatch) != static_cast<std::size_t>(rows) ||
      (rows > 0 && row.Int(rows_column + 1) != 2)) {
    throw DatabaseError("a blob of matches of the wrong size");
  }
  FeatureMatches matches(static_cast<std::size_t>(rows));
  if (size > 0) std::memcpy(matches.data(), data, size);
  for (const FeatureMatch& match : matches) {
    if (match.feature1 < num_features1 && match.feature2 < num_features2) continue;
    throw DatabaseError("a match of features that the images do not have");
  }
  return matches;
}

void BindMatches(const FeatureMatches& matches, int rows_parameter, sqlite::Statement* statement) {
  statement->Bind(rows_parameter, static_cast<std::int64_t>(matches.size()))
      .Bind(rows_parameter + 1, std::int64_t{2})
      .BindBytes(rows_parameter + 2, matches.data(), matches.size() * sizeof(FeatureMatch));
}

TwoViewGeometryCodec::TwoViewGeometryCodec(const std::vector<std::string>& existing_columns,
                                           bool zeros_for_unset)
    : columns_({"rows", "cols", "data", "config"}), zeros_for_unset_(zeros_for_unset) {
  for (const char* column : kValueColumns) {
    const bool exists = std::find(existing_columns.begin(), existing_columns.end(), column) !=
                        existing_columns.end();
    if (exists) columns_.emplace_back(column);
  }
}

TwoViewGeometry TwoViewGeometryCodec::Decode(const sqlite::Statement& row, int first_column,
                                             std::size_t num_features1,
                                             std::size_t num_features2) const {
  TwoViewGeometry geometry;
  geometry.inliers = DecodeMatches(row, first_column, num_features1, num_features2);
  const std::int64_t configuration = row.Int(first_column + 3);
  if (configuration < 0 || configuration > kMaxTwoViewConfiguration) {
    throw DatabaseError("the unknown configuration " + std::to_string(configuration));
  }
  geometry.configuration = static_cast<TwoViewConfiguration>(configuration);
  std::optional<std::array<double, 4>> rotation;
  std::optional<std::array<double, 3>> translation;
  for (std::size_t i = kNumFixedColumns; i < columns_.size(); ++i) {
    const std::string& name = columns_[i];
    const int column = first_column + static_cast<int>(i);
    if (name == "F") {
      geometry.F = ReadMatrix(row, column, name);
    } else if (name == "E") {
      geometry.E = ReadMatrix(row, column, name);
    } else if (name == "H") {
      geometry.H = ReadMatrix(row, column, name);
    } else if (name == "qvec") {
      if (!ReadDoubles(row, column, name, &rotation.emplace())) rotation.reset();
    } else if (name == "tvec") {
      if (!ReadDoubles(row, column, name, &translation.emplace())) translation.reset();
    } else if (!row.IsNull(column)) {
      geometry.cameras[name == "camera1" ? 0 : 1] = row.CopyBlob(column);
    }
  }
  geometry.pose = PoseOf(rotation, translation);
  return geometry;
}

void TwoViewGeometryCodec::Bind(const TwoViewGeometry& geometry, int first_parameter,
                                sqlite::Statement* statement) const {
  BindMatches(geometry.inliers, first_parameter, statement);
  statement->Bind(first_parameter + 3, static_cast<std::int64_t>(geometry.configuration));
  // COLMAP 3.8 expects a matrix wherever there are inliers.
  const bool zeros = zeros_for_unset_ && !geometry.inliers.empty();
  const auto bind = [&](std::size_t i, const auto* values, std::size_t size) {
    const int parameter = first_parameter + static_cast<int>(i);
    if (values != nullptr) {
      statement->BindBytes(parameter, values, size);
    } else if (zeros) {
      statement->BindBytes(parameter, kZeros.data(), size);
    } else {
      statement->BindNull(parameter);
    }
  };
  const auto pointer = [](const auto& optional) { return optional ? &*optional : nullptr; };
  const RelativePose* pose = pointer(geometry.pose);
  for (std::size_t i = kNumFixedColumns; i < columns_.size(); ++i) {
    const std::string& name = columns_[i];
    if (name == "F") {
      bind(i, pointer(geometry.F), sizeof(Matrix3));
    } else if (name == "E") {
      bind(i, pointer(geometry.E), sizeof(Matrix3));
    } else if (name == "H") {
      bind(i, pointer(geometry.H), sizeof(Matrix3));
    } else if (name == "qvec") {
      bind(i, pose == nullptr ? nullptr : &pose->rotation, sizeof(RelativePose::rotation));
    } else if (name == "tvec") {
      bind(i, pose == nullptr ? nullptr : &pose->translation, sizeof(RelativePose::translation));
    } else if (const auto& camera = geometry.cameras[name == "camera1" ? 0 : 1]) {
      statement->Bind(first_parameter + static_cast<int>(i), *camera);
    } else {
      statement->BindNull(first_parameter + static_cast<int>(i));
    }
  }
}

std::string JoinColumns(const std::vector<std::string>& columns) {
  std::string joined;
  for (const std::string& column : columns) joined += (joined.empty() ? "" : ", ") + column;
  return joined;
}

}  // namespace colmap_graphmatch
