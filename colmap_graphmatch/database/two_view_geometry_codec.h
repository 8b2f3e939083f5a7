#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/database/sqlite.h"

namespace colmap_graphmatch {

// Reads the matches of a row: num x 2 uint32 feature indices, row-major; rows, cols and data are
// columns, one after the other. Throws DatabaseError if the sizes contradict each other or a
// feature is not among the first num_features1 or num_features2; the message says what there is,
// not where.
FeatureMatches DecodeMatches(const sqlite::Statement& row, int rows_column,
                             std::size_t num_features1, std::size_t num_features2);

// Binds rows, cols and data. The matches must outlive the next Step.
void BindMatches(const FeatureMatches& matches, int rows_parameter, sqlite::Statement* statement);

// How the table `two_view_geometries` of a database stores a geometry: F, E and H have 9 doubles,
// row-major, qvec 4 and tvec 3; later versions of COLMAP have more columns.
class TwoViewGeometryCodec {
 public:
  // existing_columns: of the table; what it has no column for is neither read nor written.
  // zeros_for_unset: up to COLMAP 3.8 zeros stand for what is not set, NULL since.
  TwoViewGeometryCodec(const std::vector<std::string>& existing_columns, bool zeros_for_unset);

  // rows, cols, data, config, and those of the others that exist.
  const std::vector<std::string>& Columns() const { return columns_; }

  // Of a row whose columns from first_column on are Columns(). Zeros of either sign, and the
  // identity in place of a pose (COLMAP 3.9 to 3.13), are not set. Throws DatabaseError as
  // DecodeMatches does, also for matrices of a wrong size and unknown configurations.
  TwoViewGeometry Decode(const sqlite::Statement& row, int first_column, std::size_t num_features1,
                         std::size_t num_features2) const;

  // The geometry must outlive the next Step.
  void Bind(const TwoViewGeometry& geometry, int first_parameter,
            sqlite::Statement* statement) const;

 private:
  std::vector<std::string> columns_;
  bool zeros_for_unset_;
};

// "a, b, c".
std::string JoinColumns(const std::vector<std::string>& columns);

}  // namespace colmap_graphmatch
