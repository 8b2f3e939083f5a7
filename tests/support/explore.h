#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "colmap_graphmatch/graph/explorer.h"
#include "colmap_graphmatch/graph/graphmatch.h"
#include "colmap_graphmatch/graph/listed_pairs.h"
#include "colmap_graphmatch/graph/retrieval.h"
#include "colmap_graphmatch/graph/seeds.h"

namespace colmap_graphmatch {

// Explore with each of the proposers.

inline std::vector<ImagePair> ChooseGraphMatchSeeds(const GraphMatchOptions& options,
                                                    const Ranking& ranking,
                                                    const std::vector<ImageId>& ids,
                                                    PairVerifier& verifier, ThreadPool& threads,
                                                    const std::vector<ImagePair>& earlier) {
  const auto make = [&] { return std::make_unique<GraphMatchProposer>(options, ranking, threads); };
  return ChooseSeeds(make, ids, verifier, earlier, StopRequest());
}

inline ExplorationResult RunGraphMatch(const GraphMatchOptions& options, const Ranking& ranking,
                                       const std::vector<ImageId>& ids, PairVerifier& verifier,
                                       ThreadPool& threads, const OnProgress& on_progress,
                                       std::vector<ImagePair> seeds) {
  GraphMatchProposer proposer(options, ranking, threads);
  return Explore(proposer, ids, verifier, on_progress, {std::move(seeds)});
}

inline ExplorationResult RunGraphMatch(const GraphMatchOptions& options, const Ranking& ranking,
                                       const std::vector<ImageId>& ids, PairVerifier& verifier,
                                       ThreadPool& threads, const OnProgress& on_progress) {
  return RunGraphMatch(options, ranking, ids, verifier, threads, on_progress,
                       ChooseGraphMatchSeeds(options, ranking, ids, verifier, threads, {}));
}

inline ExplorationResult RunRetrieval(const RetrievalOptions& options, const Ranking& ranking,
                                      const std::vector<ImageId>& ids, PairVerifier& verifier,
                                      ThreadPool& threads, const OnProgress& on_progress) {
  RetrievalProposer proposer(options, ranking, threads);
  return Explore(proposer, ids, verifier, on_progress);
}

inline ExplorationResult VerifyAllPairs(const std::vector<ImageId>& ids, PairVerifier& verifier,
                                        const OnProgress& on_progress,
                                        const PairRestrictions& restrictions = {}) {
  AllPairsProposer proposer(restrictions);
  return Explore(proposer, ids, verifier, on_progress);
}

inline ExplorationResult VerifyListedPairs(const std::vector<ImagePair>& pairs,
                                           const std::vector<ImageId>& ids, PairVerifier& verifier,
                                           const OnProgress& on_progress,
                                           const PairRestrictions& restrictions = {}) {
  ListedPairsProposer proposer(pairs, ids, restrictions);
  return Explore(proposer, ids, verifier, on_progress);
}

}  // namespace colmap_graphmatch
