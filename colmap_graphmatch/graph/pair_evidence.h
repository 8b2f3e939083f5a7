#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/graph/edge_model.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"
#include "colmap_graphmatch/graph/shared_tracks.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// An untested pair and what is known of it.
struct Candidate {
  VertexPair pair;
  Cues cues = {};
  // One of its images has no neighbour yet and was tested with few: it draws on, however unlikely
  // the pair is.
  bool is_of_lonely = false;
};

// Collects what the ranking, the graph and the inliers say about pairs that were not tested.
class PairEvidence {
 public:
  // Tests after which an image without a neighbour is left to its likelihood.
  static constexpr std::size_t kMaxTestsOfLonely = 40;

  // All must outlive it.
  PairEvidence(const Ranking& ranking, const PairRestrictions& restrictions, ThreadPool& threads);

  // The pairs that the paper's two moves could make, ascending, each once: those of images that
  // have a neighbour in common (propagation), and of each image the num_nearest nearest untested
  // ones (sampling).
  std::vector<Candidate> Collect(std::size_t num_nearest, const MatchingGraph& graph,
                                 const SharedTracks& tracks) const;

  // What would be known of these pairs of the graph if they alone had not been tested. tested:
  // ascending.
  std::vector<LabelledCues> Describe(const std::vector<TestedVertexPair>& tested,
                                     const MatchingGraph& graph, const SharedTracks& tracks) const;

 private:
  class OfVertex;

  // The place of an image in the list of another, counted from 0; behind all if it is not listed.
  std::size_t RankOf(Vertex listed, Vertex vertex) const;

  const Ranking& ranking_;
  const PairRestrictions& restrictions_;
  ThreadPool& threads_;
  // By vertex: its list, ascending, with places; and the distance that is usual in it.
  std::vector<std::vector<std::pair<Vertex, std::uint32_t>>> places_;
  std::vector<double> usual_distances_;
};

}  // namespace colmap_graphmatch
