#include <algorithm>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/database/rows.h"

namespace colmap_graphmatch {
namespace {

constexpr const char* kAdviceOnInliers =
    ". Were features extracted again after matching? Delete the rows of matches and "
    "two_view_geometries, so that these pairs are matched again.";

// False for keys that COLMAP never writes, e.g. with the larger id first: they name no pair.
bool IsColmapsKey(PairId pair_id) {
  const ImagePair pair = DecodePair(pair_id);
  return pair.id1 != 0 && pair.id1 != pair.id2 && EncodePair(pair) == pair_id;
}

}  // namespace

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

FeatureMatches Database::ReadMatches(const ImagePair& pair) {
  return ReadMatchesFrom("matches", pair);
}

FeatureMatches Database::ReadInliers(const ImagePair& pair) {
  return ReadMatchesFrom("two_view_geometries", pair);
}

FeatureMatches Database::ReadMatchesFrom(const std::string& table, const ImagePair& pair) {
  const auto num_features = [this](ImageId id) {
    sqlite::Statement select(connection_, "SELECT rows FROM keypoints WHERE image_id = ?1");
    const bool found = select.Bind(1, std::int64_t{id}).Step();
    return found ? static_cast<std::size_t>(std::max<std::int64_t>(0, select.Int(0))) : 0;
  };
  sqlite::Statement select(connection_,
                           "SELECT rows, cols, data FROM " + table + " WHERE pair_id = ?1");
  if (!select.Bind(1, static_cast<std::int64_t>(EncodePair(pair))).Step()) return {};
  try {
    return DecodeMatches(select, 0, num_features(pair.id1), num_features(pair.id2));
  } catch (const DatabaseError& error) {
    throw DamagedMatchesError("The matches in the table " + table + " that " + Path().string() +
                              " has for the images with ids " + std::to_string(pair.id1) + " and " +
                              std::to_string(pair.id2) + " contain " + error.what() +
                              (table == "matches" ? kAdviceOnUnverifiedMatches : kAdviceOnInliers));
  }
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

std::vector<TestedPair> Database::WritePairs(const std::vector<PairGeometry>& pairs) {
  CheckInPlace();
  if (!pages_are_checked_) {
    for (const char* table : {"matches", "two_view_geometries"}) connection_.CheckPages(table);
    pages_are_checked_ = true;
  }
  connection_.FinishWrites();
  const std::size_t num_columns = codec_.Columns().size();
  std::string parameters = "?1";
  for (std::size_t i = 0; i < num_columns; ++i) parameters += ", ?" + std::to_string(i + 2);
  sqlite::Transaction transaction(connection_);
  CheckFeatures(pairs);
  sqlite::Statement select_other(connection_,
                                 "SELECT rows, config FROM two_view_geometries WHERE pair_id = ?1");
  std::vector<TestedPair> of_others;
  sqlite::Statement insert_matches(
      connection_,
      "INSERT OR REPLACE INTO matches(pair_id, rows, cols, data) VALUES(?1, ?2, ?3, ?4)");
  sqlite::Statement insert_geometry(connection_, "INSERT INTO two_view_geometries(pair_id, " +
                                                     JoinColumns(codec_.Columns()) + ") VALUES(" +
                                                     parameters + ")");
  for (const PairGeometry& pair : pairs) {
    const auto pair_id = static_cast<std::int64_t>(EncodePair(pair.pair));
    const bool tested_by_others = select_other.Bind(1, pair_id).Step();
    if (tested_by_others) {
      of_others.push_back({pair.pair,
                           static_cast<std::size_t>(std::max<std::int64_t>(0, select_other.Int(0))),
                           static_cast<int>(select_other.Int(1))});
    }
    select_other.Reset();
    if (tested_by_others) continue;

    insert_matches.Bind(1, pair_id);
    BindMatches(pair.matches, 2, &insert_matches);
    insert_matches.Run();
    insert_geometry.Bind(1, pair_id);
    codec_.Bind(pair.geometry, 2, &insert_geometry);
    insert_geometry.Run();
  }
  transaction.Commit();
  CheckInPlace();
  return of_others;
}

}  // namespace colmap_graphmatch
