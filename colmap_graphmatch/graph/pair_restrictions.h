#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// Which pairs may be tested at all, and on whose behalf. By default all.
struct PairRestrictions {
  // By vertex: whether it looks for partners. A pair is tested only if one of its images does.
  // Empty: all do.
  std::vector<bool> seeking;

  // By vertex: the frame that its image belongs to, 0 for none. Pairs within one frame are not
  // tested. Empty: no frames.
  std::vector<std::uint32_t> frames;

  bool Seeks(Vertex vertex) const { return seeking.empty() || seeking[vertex]; }

  bool SameFrame(Vertex a, Vertex b) const {
    return !frames.empty() && frames[a] != 0 && frames[a] == frames[b];
  }

  bool Allows(Vertex a, Vertex b) const { return (Seeks(a) || Seeks(b)) && !SameFrame(a, b); }

  // Names the values of all fields by their lengths and checksums.
  std::string Key() const;
};

}  // namespace colmap_graphmatch
