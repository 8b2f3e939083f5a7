#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/database/rows.h"

namespace colmap_graphmatch {
namespace {

bool IsImageId(std::int64_t id) { return id > 0 && id < static_cast<std::int64_t>(kMaxNumImages); }

bool ContainAll(const std::vector<std::string>& columns, const std::vector<std::string>& wanted) {
  return std::all_of(wanted.begin(), wanted.end(),
                     [&](const std::string& column) { return Contains(columns, column); });
}

}  // namespace

std::map<ImageId, PositionPrior> Database::ReadPositions() {
  const std::vector<std::string> columns = connection_.Columns("pose_priors");
  std::map<ImageId, PositionPrior> positions;
  if (!columns.empty()) positions = ReadPosePriors(columns);
  // A newer COLMAP that opened the database of an older one has made the table, and left it empty.
  return positions.empty() ? ReadPositionsOfImages() : positions;
}

std::map<ImageId, PositionPrior> Database::ReadPosePriors(const std::vector<std::string>& columns) {
  std::map<ImageId, PositionPrior> positions;
  // Since COLMAP 4.0 priors belong to what a sensor saw; SensorType::CAMERA is 0.
  const bool has_sensors = Contains(columns, "corr_data_id");
  const std::string id = has_sensors ? "corr_data_id" : "image_id";
  if (!ContainAll(columns, {id, "position", "coordinate_system"})) return positions;
  const std::string covariance =
      Contains(columns, "position_covariance") ? "position_covariance" : "NULL";
  sqlite::Statement select(
      connection_, "SELECT " + id + ", position, coordinate_system, " + covariance +
                       ", rowid FROM pose_priors WHERE typeof(position) = 'blob'" +
                       (has_sensors ? " AND corr_sensor_type = 0" : "") + " ORDER BY rowid");
  AscendingKeys keys;
  while (select.Step()) {
    if (!keys.Add(select.Int(4))) ThrowDamaged("the rows of pose_priors do not ascend");
    PositionPrior prior;
    if (!IsImageId(select.Int(0)) || select.Size(1) != sizeof(prior.position)) continue;
    std::memcpy(prior.position.data(), select.Data(1), sizeof(prior.position));
    // PosePrior::CoordinateSystem in COLMAP (src/colmap/geometry/pose_prior.h): WGS84 is 0.
    prior.system =
        select.Int(2) == 0 ? PositionPrior::System::kGeographic : PositionPrior::System::kCartesian;
    std::array<double, 9> matrix = {};
    if (select.Size(3) == sizeof(matrix))
      std::memcpy(matrix.data(), select.Data(3), sizeof(matrix));
    const double variance = std::max({matrix[0], matrix[4], matrix[8]});
    if (std::isfinite(variance) && variance > 0) prior.accuracy = std::sqrt(variance);
    const auto& [x, y, z] = prior.position;
    if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) continue;
    positions.emplace(static_cast<ImageId>(select.Int(0)), prior);
  }
  return positions;
}

std::map<ImageId, PositionPrior> Database::ReadPositionsOfImages() {
  std::map<ImageId, PositionPrior> positions;
  if (!ContainAll(connection_.Columns("images"), {"prior_tx", "prior_ty", "prior_tz"})) {
    return positions;
  }
  sqlite::Statement select(connection_,
                           "SELECT image_id, prior_tx, prior_ty, prior_tz FROM images "
                           "WHERE prior_tx IS NOT NULL ORDER BY image_id");
  AscendingKeys ids;
  std::size_t num_geographic = 0;
  while (select.Step()) {
    if (!ids.Add(select.Int(0))) ThrowDamaged("the ids of its images do not ascend");
    const std::array<double, 3> position = {select.Double(1), select.Double(2), select.Double(3)};
    // What scripts write for none.
    if (position == std::array<double, 3>{0, 0, 0} || !IsImageId(select.Int(0))) continue;
    if (std::abs(position[0]) <= 90 && std::abs(position[1]) <= 180) ++num_geographic;
    positions[static_cast<ImageId>(select.Int(0))].position = position;
  }
  // What COLMAP's feature_extractor wrote is GPS; a user may have written anything, and something
  // else where there is none.
  const bool are_geographic = 2 * num_geographic > positions.size();
  for (auto& [id, prior] : positions) {
    prior.system =
        are_geographic ? PositionPrior::System::kGeographic : PositionPrior::System::kCartesian;
  }
  return positions;
}

}  // namespace colmap_graphmatch
