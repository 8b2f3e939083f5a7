#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/graph/edge_model.h"
#include "colmap_graphmatch/graph/image_priors.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"
#include "colmap_graphmatch/graph/shared_tracks.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

class EvidenceChanges;

// An untested pair and what is known of it.
struct Candidate {
  VertexPair pair;
  Cues cues = {};
  std::size_t num_common = 0;  // Neighbours in common.
  // One of its images has no neighbour yet and was tested with few: it draws on, however unlikely
  // the pair is.
  bool is_of_lonely = false;
};

// What the ranking, priors, the graph and the inliers say about pairs that may be tested. Of those
// with a neighbour in common it is kept, and brought up to date with the tests. Memory: 32 bytes
// for each of these pairs, and room to grow.
class PairEvidence {
 public:
  // Tests after which an image without a neighbour is left to its likelihood.
  static constexpr std::size_t kMaxTestsOfLonely = 30;

  // All must outlive it.
  PairEvidence(const Ranking& ranking, const ImagePriors& priors,
               const PairRestrictions& restrictions, ThreadPool& threads);
  ~PairEvidence();
  PairEvidence(const PairEvidence&) = delete;
  PairEvidence& operator=(const PairEvidence&) = delete;

  // Takes note of tests, each once, in any order. graph and tracks have them already, and no others
  // that were not noted.
  void Add(const std::vector<TestedVertexPair>& tests, const MatchingGraph& graph,
           const SharedTracks& tracks);

  // Calls visit(task, candidate), for different tasks at once, for the pairs that the paper's two
  // moves could make, each once: those of images that have a neighbour in common (propagation), and
  // of each image untested ones (sampling): the num_nearest nearest, and the first num_near in its
  // sequence and by position. task: less than NumTasks(); of one task always the same pairs in the
  // same order. graph: as of the last Add.
  using Visit = std::function<void(std::size_t task, const Candidate& candidate)>;
  void VisitCandidates(std::size_t num_nearest, std::size_t num_near, const MatchingGraph& graph,
                       const Visit& visit) const;
  std::size_t NumTasks() const { return num_tasks_; }

  // What is known of a pair that was not tested.
  Cues Of(const VertexPair& pair, const MatchingGraph& graph) const;

  // What would be known of these pairs of the graph if they alone had not been tested; also of
  // those that may not be.
  std::vector<LabelledCues> WithoutThem(const std::vector<TestedVertexPair>& tested,
                                        const MatchingGraph& graph,
                                        const SharedTracks& tracks) const;

 private:
  struct Entry;
  // Of the pair itself, which the graph has and its cues must not know.
  enum class OwnTest { kNone, kNoEdge, kEdge };

  void Update(Vertex a, const std::vector<Vertex>& changed, const EvidenceChanges& changes,
              const MatchingGraph& graph);
  const Entry* Find(Vertex a, Vertex c) const;
  // Without neighbours in common.
  Entry MakeEntry(Vertex a, Vertex c, const MatchingGraph& graph) const;
  void CountCommon(Vertex a, const MatchingGraph& graph, const SharedTracks& tracks,
                   Entry* entry) const;
  // The pair's, by the vertex that it is found with: kept, or made.
  std::pair<Vertex, Entry> EntryOf(const VertexPair& pair, const MatchingGraph& graph) const;
  Cues CuesOf(Vertex a, const Entry& entry, OwnTest own, const MatchingGraph& graph) const;
  double RelativeDistance(Vertex a, const Entry& entry) const;
  // Calls body(task, begin, end), in parallel, for the parts of size things.
  template <typename Body>
  void ForEachTask(std::size_t size, const Body& body) const;

  const Ranking& ranking_;
  const ImagePriors& priors_;
  const PairRestrictions& restrictions_;
  ThreadPool& threads_;
  std::size_t num_tasks_;
  std::vector<double> usual_distances_;      // By vertex: what is usual in its list.
  std::vector<std::vector<Entry>> entries_;  // By vertex: the pairs it owns, ascending.
};

}  // namespace colmap_graphmatch
