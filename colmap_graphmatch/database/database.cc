#include "colmap_graphmatch/database/database.h"

#include <algorithm>
#include <map>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/rows.h"

namespace colmap_graphmatch {
namespace {

// The first schema in which an unset matrix is NULL and zeros would count as set (COLMAP 3.9).
constexpr std::int64_t kFirstVersionWithNull = 3900;

// COLMAP 4.2, the first that is known to store pairs with too few matches as degenerate instead of
// undefined.
constexpr std::int64_t kFirstVersionWithDegenerate = 4020000;

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
  cameras_have_prior_ = Contains(connection_.Columns("cameras"), "prior_focal_length");
  descriptors_have_type_ = Contains(connection_.Columns("descriptors"), "type");

  sqlite::Statement version(connection_, "PRAGMA user_version");
  version.Step();
  if (version.Int(0) >= kFirstVersionWithDegenerate) {
    unmatched_ = TwoViewConfiguration::kDegenerate;
  }
  codec_ = TwoViewGeometryCodec(connection_.Columns("two_view_geometries"),
                                version.Int(0) < kFirstVersionWithNull);
}

void Database::CheckWritable() { const sqlite::Transaction rolled_back(connection_); }

void Database::CheckInPlace() {
  if (!connection_.HasMoved()) return;
  throw DatabaseError(Path().string() +
                      " was moved, deleted or replaced by another file during the run. What was "
                      "verified since then went with the old file. Run the same command again.");
}

}  // namespace colmap_graphmatch
