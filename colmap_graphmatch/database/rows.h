#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

// What reading the rows of a COLMAP database takes; not installed.

namespace colmap_graphmatch {

inline bool Contains(const std::vector<std::string>& values, const std::string& value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

// What follows what is wrong with matches that were stored and not verified. What was verified is
// not to be lost with them.
inline constexpr const char* kAdviceOnUnverifiedMatches =
    ". Were features extracted again after matching? Delete matches that were not verified, so "
    "that these pairs are matched again: sqlite3 FILE \"DELETE FROM matches WHERE pair_id NOT IN "
    "(SELECT pair_id FROM two_view_geometries)\".";

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

}  // namespace colmap_graphmatch
