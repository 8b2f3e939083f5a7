#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// Which pairs may be tested at all, and on whose behalf. By default all.
struct PairRestrictions {
  // By vertex: whether it is a query image, one that looks for partners. A pair is tested only if
  // one of its images is. Empty: all are.
  std::vector<bool> queries;

  // By vertex: the frame that its image belongs to, 0 for none. Pairs within one frame are not
  // tested. Empty: no frames.
  std::vector<std::uint32_t> frames;

  bool IsQuery(Vertex vertex) const { return queries.empty() || queries[vertex]; }

  bool SameFrame(Vertex a, Vertex b) const {
    return !frames.empty() && frames[a] != 0 && frames[a] == frames[b];
  }

  bool Allows(Vertex a, Vertex b) const { return (IsQuery(a) || IsQuery(b)) && !SameFrame(a, b); }

  // Whether what is known of a pair is kept with a: with the query if that is one of them alone,
  // otherwise with the smaller one. So what has no query costs nothing.
  bool Owns(Vertex a, Vertex b) const { return IsQuery(a) && (a < b || !IsQuery(b)); }

  // Names the values of all fields by their lengths and checksums.
  std::string Key() const;
};

}  // namespace colmap_graphmatch
