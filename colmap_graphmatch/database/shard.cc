#include "colmap_graphmatch/database/shard.h"

#include <algorithm>
#include <string>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/rows.h"
#include "colmap_graphmatch/database/sqlite.h"
#include "colmap_graphmatch/database/two_view_geometry_codec.h"

namespace colmap_graphmatch {
namespace {

// "INSERT INTO table(common columns) SELECT common columns FROM source.table", so that databases of
// different versions of COLMAP can be copied into each other. Columns without a counterpart take
// their default; replacements give the expression for a column that is not to be copied as it is.
std::string CopyTable(sqlite::Connection& shard, const std::string& table,
                      const std::map<std::string, std::string>& replacements) {
  const std::vector<std::string> target = shard.Columns(table);
  const std::vector<std::string> source = shard.Columns(table, "source");
  std::string names;
  std::string values;
  for (const std::string& column : target) {
    const auto replacement = replacements.find(column);
    const bool in_source = std::find(source.begin(), source.end(), column) != source.end();
    if (!in_source && replacement == replacements.end()) continue;
    const std::string separator = names.empty() ? "" : ", ";
    names += separator + column;
    values += separator + (replacement != replacements.end() ? replacement->second : column);
  }
  return "INSERT INTO main." + table + "(" + names + ") SELECT " + values + " FROM source." + table;
}

std::size_t NumKeypoints(sqlite::Connection& shard, ImageId image_id) {
  sqlite::Statement select(shard, "SELECT rows FROM main.keypoints WHERE image_id = ?1");
  const bool found = select.Bind(1, std::int64_t{image_id}).Step();
  return found ? static_cast<std::size_t>(std::max<std::int64_t>(0, select.Int(0))) : 0;
}

// COLMAP takes the matches that a database has as they are and would read beyond the features.
void CheckCopiedMatches(sqlite::Connection& shard, const std::filesystem::path& database_path) {
  sqlite::Statement select(shard, "SELECT rows, cols, data, pair_id FROM main.matches");
  while (select.Step()) {
    const ImagePair pair = DecodePair(static_cast<PairId>(select.Int(3)));
    try {
      DecodeMatches(select, 0, NumKeypoints(shard, pair.id1), NumKeypoints(shard, pair.id2));
    } catch (const DatabaseError& error) {
      throw DatabaseError("The matches that " + database_path.string() +
                          " has for the images with ids " + std::to_string(pair.id1) + " and " +
                          std::to_string(pair.id2) + " contain " + error.what() +
                          kAdviceOnUnverifiedMatches);
    }
  }
}

}  // namespace

std::string ShardImageName(ImageId image_id) { return std::to_string(image_id); }

ShardFeatures FillShard(const std::filesystem::path& shard_path,
                        const std::filesystem::path& database_path,
                        const sqlite::LockPatience& patience, const std::vector<ShardPair>& pairs,
                        bool with_descriptors) {
  sqlite::Connection shard(shard_path, sqlite::Access::kReadWrite, patience);
  shard.AttachReadOnly(database_path, "source");
  // A shard is thrown away when anything goes wrong: it need not survive a crash.
  shard.Execute("PRAGMA main.synchronous = OFF");
  shard.Execute("CREATE TEMP TABLE ids(image_id INTEGER PRIMARY KEY)");
  shard.Execute("CREATE TEMP TABLE pair_ids(pair_id INTEGER PRIMARY KEY)");

  sqlite::Transaction transaction(shard);
  sqlite::Statement add_id(shard, "INSERT OR IGNORE INTO ids VALUES(?1)");
  sqlite::Statement add_pair(shard, "INSERT OR IGNORE INTO pair_ids VALUES(?1)");
  for (const auto& [pair, matches] : pairs) {
    add_id.Bind(1, std::int64_t{pair.id1}).Run();
    add_id.Bind(1, std::int64_t{pair.id2}).Run();
    add_pair.Bind(1, static_cast<std::int64_t>(EncodePair(pair))).Run();
  }
  const std::string of_images = " WHERE image_id IN (SELECT image_id FROM ids)";
  shard.Execute(CopyTable(shard, "cameras", {}) +
                " WHERE camera_id IN (SELECT camera_id FROM source.images" + of_images + ")");
  shard.Execute(CopyTable(shard, "images", {{"name", "CAST(image_id AS TEXT)"}}) + of_images);
  const bool brings_matches =
      !with_descriptors && std::all_of(pairs.begin(), pairs.end(), [](const ShardPair& pair) {
        return pair.matches.has_value();
      });
  ShardFeatures features;
  if (brings_matches) {
    features = FeaturesOf(pairs);
    CopyKeypoints(shard, &features);
  } else {
    shard.Execute(CopyTable(shard, "keypoints", {}) + of_images);
  }
  if (with_descriptors) {
    const std::vector<std::string> source_columns = shard.Columns("descriptors", "source");
    const bool typed =
        std::find(source_columns.begin(), source_columns.end(), "type") != source_columns.end();
    // 0 is SIFT, the only type that versions without the column had.
    shard.Execute(CopyTable(shard, "descriptors",
                            typed ? std::map<std::string, std::string>{}
                                  : std::map<std::string, std::string>{{"type", "0"}}) +
                  of_images);
  }
  if (!brings_matches) {
    shard.Execute(CopyTable(shard, "matches", {}) +
                  " WHERE pair_id IN (SELECT pair_id FROM pair_ids) AND pair_id NOT IN "
                  "(SELECT pair_id FROM source.two_view_geometries)");
    CheckCopiedMatches(shard, database_path);
  }
  sqlite::Statement add_matches(
      shard,
      "INSERT OR REPLACE INTO main.matches(pair_id, rows, cols, data) VALUES(?1, ?2, ?3, ?4)");
  for (const auto& [pair, matches] : pairs) {
    if (!matches) continue;
    add_matches.Bind(1, static_cast<std::int64_t>(EncodePair(pair)));
    const FeatureMatches of_shard = ToShard(pair, *matches, features);  // Bound, not copied.
    BindMatches(of_shard, 2, &add_matches);
    add_matches.Run();
  }
  if (!with_descriptors) {
    sqlite::Statement has_matches(shard, "SELECT 1 FROM main.matches WHERE pair_id = ?1");
    for (const auto& [pair, matches] : pairs) {
      const bool found = has_matches.Bind(1, static_cast<std::int64_t>(EncodePair(pair))).Step();
      has_matches.Reset();
      if (found) continue;
      throw DatabaseError("The matches of the images with ids " + std::to_string(pair.id1) +
                          " and " + std::to_string(pair.id2) + " in " + database_path.string() +
                          " disappeared. Let the other program finish first.");
    }
  }
  transaction.Commit();
  return features;
}

std::vector<PairGeometry> ReadShard(const std::filesystem::path& shard_path,
                                    const std::vector<ImagePair>& pairs,
                                    const std::map<ImageId, std::size_t>& num_features,
                                    const ShardFeatures& features) {
  const auto num_features_of = [&](ImageId image) {
    const auto listed = features.find(image);
    return listed == features.end() ? num_features.at(image) : listed->second.size();
  };
  sqlite::Connection shard(shard_path, sqlite::Access::kReadWrite, 0);
  const TwoViewGeometryCodec codec(shard.Columns("two_view_geometries"), false);
  sqlite::Statement select_matches(shard,
                                   "SELECT rows, cols, data FROM matches WHERE pair_id = ?1");
  sqlite::Statement select_geometry(shard, "SELECT " + JoinColumns(codec.Columns()) +
                                               " FROM two_view_geometries WHERE pair_id = ?1");

  std::vector<PairGeometry> results;
  results.reserve(pairs.size());
  for (const ImagePair& pair : pairs) {
    const auto pair_id = static_cast<std::int64_t>(EncodePair(pair));
    PairGeometry result;
    result.pair = pair;
    try {
      if (!select_matches.Bind(1, pair_id).Step() || !select_geometry.Bind(1, pair_id).Step()) {
        throw DatabaseError("no result");
      }
      const std::size_t num1 = num_features_of(pair.id1);
      const std::size_t num2 = num_features_of(pair.id2);
      result.matches = FromShard(pair, DecodeMatches(select_matches, 0, num1, num2), features);
      result.geometry = codec.Decode(select_geometry, 0, num1, num2);
      result.geometry.inliers = FromShard(pair, std::move(result.geometry.inliers), features);
    } catch (const DatabaseError& error) {
      throw DatabaseError("COLMAP wrote " + std::string(error.what()) + " for the pair of images " +
                          std::to_string(pair.id1) + " and " + std::to_string(pair.id2) + ".");
    }
    select_matches.Reset();
    select_geometry.Reset();
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace colmap_graphmatch
