#pragma once

#include <memory>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/graph/pair_proposer.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"
#include "colmap_graphmatch/graph/retrieval.h"
#include "colmap_graphmatch/pipeline/options.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// The strategies that users choose from, as proposers of pairs. A new one is a proposer of its own
// and an entry here.

// Whether the strategy samples and propagates: then it starts from seeds.
bool IsLoop(PipelineOptions::Strategy strategy);

// The loop that the options come to; with a strategy that is no loop, of the paper.
GraphMatchOptions LoopOptionsOf(const PipelineOptions& options);

RetrievalOptions RetrievalOptionsOf(const PipelineOptions& options);

// What the seeds of the loop depend on, apart from the images and their vectors.
std::string LoopKey(const PipelineOptions& options, const PairRestrictions& restrictions);

// Of a strategy that ranks images: vertices are those of the ranking. ranking and threads must
// outlive it.
std::unique_ptr<PairProposer> MakeRankingProposer(const PipelineOptions& options,
                                                  const PairRestrictions& restrictions,
                                                  const Ranking& ranking, ThreadPool& threads);

}  // namespace colmap_graphmatch
