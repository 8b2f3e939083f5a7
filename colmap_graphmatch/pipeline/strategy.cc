#include "colmap_graphmatch/pipeline/strategy.h"

#include <algorithm>

#include "colmap_graphmatch/graph/graphmatch.h"

namespace colmap_graphmatch {

using Strategy = PipelineOptions::Strategy;

bool IsLoop(Strategy strategy) {
  return strategy == Strategy::kGraphMatch || strategy == Strategy::kSampling ||
         strategy == Strategy::kPropagation;
}

GraphMatchOptions LoopOptionsOf(const PipelineOptions& options) {
  GraphMatchOptions graph = options.graph;
  if (options.strategy == Strategy::kSampling) graph.num_to_propagate = 0;
  if (options.strategy == Strategy::kPropagation) {
    graph.number_sample_iterations = std::min(graph.number_sample_iterations, 1);
  }
  return graph;
}

RetrievalOptions RetrievalOptionsOf(const PipelineOptions& options) {
  const bool expands = options.strategy == Strategy::kBriad;
  RetrievalOptions retrieval;
  retrieval.num_images = options.num_retrieved_images > 0 ? options.num_retrieved_images
                         : expands                        ? 40
                                                          : 120;
  retrieval.num_expansions = expands ? options.num_expansions : 0;
  return retrieval;
}

std::string LoopKey(const PipelineOptions& options, const PairRestrictions& restrictions) {
  GraphMatchOptions graph = LoopOptionsOf(options);
  graph.restrictions = restrictions;
  return "loop: " + graph.Key() + ", inliers " +
         std::to_string(options.verification.geometry.min_num_inliers);
}

std::unique_ptr<PairProposer> MakeRankingProposer(const PipelineOptions& options,
                                                  const PairRestrictions& restrictions,
                                                  const Ranking& ranking, ThreadPool& threads) {
  if (IsLoop(options.strategy)) {
    GraphMatchOptions graph = LoopOptionsOf(options);
    graph.restrictions = restrictions;
    return std::make_unique<GraphMatchProposer>(graph, ranking, threads);
  }
  RetrievalOptions retrieval = RetrievalOptionsOf(options);
  retrieval.restrictions = restrictions;
  return std::make_unique<RetrievalProposer>(retrieval, ranking, threads);
}

}  // namespace colmap_graphmatch
