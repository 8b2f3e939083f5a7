#include "colmap_graphmatch/graph/evidence_changes.h"

#include <algorithm>

namespace colmap_graphmatch {
namespace {

// Calls visit for all that were tested with the vertex in vain.
template <typename Visit>
void VisitFailed(Vertex vertex, const MatchingGraph& graph, const Visit& visit) {
  auto neighbor = graph.Neighbors(vertex).begin();
  const auto end = graph.Neighbors(vertex).end();
  for (const Vertex tested : graph.Tested(vertex)) {
    if (neighbor != end && *neighbor == tested) {
      ++neighbor;
    } else {
      visit(tested);
    }
  }
}

}  // namespace

EvidenceChanges::EvidenceChanges(const PairRestrictions& restrictions, const MatchingGraph& added,
                                 const MatchingGraph& graph, const SharedTracks& tracks)
    : restrictions_(restrictions),
      added_(added),
      graph_(graph),
      tracks_(tracks),
      changes_(graph.NumVertices()) {}

const std::vector<Vertex>& EvidenceChanges::WalkFrom(Vertex a) {
  for (const Vertex vertex : touched_) changes_[vertex] = {};
  touched_.clear();
  // By both tests of a path a - b - c.
  for (const Vertex b : graph_.Neighbors(a)) {
    const MatchingGraph& of_b = IsNew(a, b) ? graph_ : added_;
    AddCommon(a, b, of_b.Neighbors(b));
    VisitFailed(b, of_b, [&](Vertex c) { AddFailed(a, c); });
  }
  VisitFailed(a, graph_, [&](Vertex b) {
    const MatchingGraph& of_b = IsNew(a, b) ? graph_ : added_;
    for (const Vertex c : of_b.Neighbors(b)) AddFailed(a, c);
  });
  std::sort(touched_.begin(), touched_.end());
  return touched_;
}

bool EvidenceChanges::IsNew(Vertex a, Vertex b) const {
  return added_.NumTestedOf(a) > 0 && added_.IsTested(a, b);
}

EvidenceChanges::Change& EvidenceChanges::Touch(Vertex vertex) {
  Change& change = changes_[vertex];
  if (!change.is_touched) {
    change.is_touched = true;
    touched_.push_back(vertex);
  }
  return change;
}

void EvidenceChanges::AddCommon(Vertex a, Vertex b, const std::vector<Vertex>& neighbors) {
  if (neighbors.empty()) return;
  const SharedTracks::Features& with_a = tracks_.Inliers(b, a);
  for (const Vertex c : neighbors) {
    if (c == a || !restrictions_.Owns(a, c)) continue;
    Change& change = Touch(c);
    ++change.num_common;
    const auto num_shared =
        static_cast<std::uint32_t>(SharedTracks::CountShared(with_a, tracks_.Inliers(b, c)));
    change.num_shared += num_shared;
    change.most_shared = std::max(change.most_shared, num_shared);
  }
}

void EvidenceChanges::AddFailed(Vertex a, Vertex c) {
  if (c != a && restrictions_.Owns(a, c)) ++Touch(c).num_failed;
}

}  // namespace colmap_graphmatch
