#pragma once

#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"
#include "colmap_graphmatch/graph/shared_tracks.h"

namespace colmap_graphmatch {

// What new tests change for the pairs that one vertex owns (PairRestrictions): only paths of two
// tests are walked, at least one of which is new. One for each thread.
class EvidenceChanges {
 public:
  // To add to what is known of a pair; but for most_shared, which is a maximum.
  struct Change {
    bool is_touched = false;
    std::uint32_t num_common = 0;
    std::uint32_t num_failed = 0;
    std::uint32_t num_shared = 0;
    std::uint32_t most_shared = 0;
  };

  // added: the new tests alone; graph and tracks have them, too. All must outlive it.
  EvidenceChanges(const PairRestrictions& restrictions, const MatchingGraph& added,
                  const MatchingGraph& graph, const SharedTracks& tracks);

  // The other vertices of pairs that change, ascending. Valid until the next call.
  const std::vector<Vertex>& WalkFrom(Vertex a);

  // Of the pair of c and the vertex that was walked from last.
  const Change& To(Vertex c) const { return changes_[c]; }

 private:
  bool IsNew(Vertex a, Vertex b) const;
  Change& Touch(Vertex vertex);
  void AddCommon(Vertex a, Vertex b, const std::vector<Vertex>& neighbors);
  void AddFailed(Vertex a, Vertex c);

  const PairRestrictions& restrictions_;
  const MatchingGraph& added_;
  const MatchingGraph& graph_;
  const SharedTracks& tracks_;
  std::vector<Change> changes_;  // By the other vertex.
  std::vector<Vertex> touched_;
};

}  // namespace colmap_graphmatch
