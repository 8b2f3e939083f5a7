#pragma once

namespace colmap_graphmatch {

// What the steps of ranking took; 0, or next to it, for one with nothing to do.
struct ImageRankingSeconds {
  double mixture = 0;
  double vectors = 0;
  double ranking = 0;

  double Sum() const { return mixture + vectors + ranking; }
};

}  // namespace colmap_graphmatch
