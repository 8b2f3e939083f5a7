#pragma once

#include <optional>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/pair_proposer.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

struct RetrievalOptions {
  // The nearest images that every image is tested with; a pair is tested if either retrieves the
  // other. At least 1. The paper retrieves 120 from a vocabulary tree, and 40 for BRIAD.
  int num_images = 120;

  // Rounds of query expansion after that. At least 0. BRIAD runs 4.
  int num_expansions = 0;

  // Images that are no queries retrieve nothing and are not expanded.
  PairRestrictions restrictions;

  // Throws OptionsError.
  void Check() const;
};

// Every image with its num_images nearest ones: the pairs ascending, each once.
std::vector<VertexPair> RetrievePairs(const RetrievalOptions& options, const Ranking& ranking,
                                      ThreadPool& threads);

// The rivals of the paper (GraphMatch, section 4): every image with its nearest ones, all in one
// batch; then, in each round of query expansion, with the neighbours of its neighbours in the graph
// that was found before (Agarwal et al., Building Rome in a Day, ICCV 2009, section 3.3: if i and k
// match j, i and k are tested).
class RetrievalProposer : public PairProposer {
 public:
  // ranking and threads must outlive it. Throws OptionsError.
  RetrievalProposer(const RetrievalOptions& options, const Ranking& ranking, ThreadPool& threads);

  std::optional<Proposal> Next(const MatchingGraph& graph) override;

 private:
  std::vector<VertexPair> Expand(const MatchingGraph& graph) const;

  const RetrievalOptions options_;
  const Ranking& ranking_;
  ThreadPool& threads_;
  int round_ = 0;  // 0: retrieval.
};

}  // namespace colmap_graphmatch
