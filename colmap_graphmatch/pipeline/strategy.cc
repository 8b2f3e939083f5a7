#include "colmap_graphmatch/pipeline/strategy.h"

#include <algorithm>
#include <stdexcept>

#include "colmap_graphmatch/graph/best_first.h"
#include "colmap_graphmatch/graph/graphmatch.h"
#include "colmap_graphmatch/graph/listed_pairs.h"

namespace colmap_graphmatch {

using Strategy = PipelineOptions::Strategy;

bool StartsFromSeeds(Strategy strategy) {
  switch (strategy) {
    case Strategy::kGraphMatch:
    case Strategy::kSampling:
    case Strategy::kPropagation:
    case Strategy::kBestFirst:
      return true;
    case Strategy::kRetrieval:
    case Strategy::kBriad:
    case Strategy::kExhaustive:
      break;
  }
  return false;
}

GraphMatchOptions LoopOptionsOf(const PipelineOptions& options) {
  GraphMatchOptions graph = options.graph;
  switch (options.strategy) {
    case Strategy::kSampling:
      graph.num_to_propagate = 0;
      break;
    case Strategy::kPropagation:
      graph.number_sample_iterations = std::min(graph.number_sample_iterations, 1);
      break;
    case Strategy::kGraphMatch:
    case Strategy::kRetrieval:
    case Strategy::kBriad:
    case Strategy::kBestFirst:
    case Strategy::kExhaustive:
      break;
  }
  return graph;
}

RetrievalOptions RetrievalOptionsOf(const PipelineOptions& options) {
  RetrievalOptions retrieval;
  switch (options.strategy) {
    case Strategy::kBriad:
      retrieval.num_images = 40;
      retrieval.num_expansions = options.num_expansions;
      break;
    case Strategy::kGraphMatch:
    case Strategy::kSampling:
    case Strategy::kPropagation:
    case Strategy::kRetrieval:
    case Strategy::kBestFirst:
    case Strategy::kExhaustive:
      break;
  }
  if (options.num_retrieved_images > 0) retrieval.num_images = options.num_retrieved_images;
  return retrieval;
}

int DrawsPerImage(const PipelineOptions& options, std::size_t num_images) {
  switch (options.strategy) {
    case Strategy::kGraphMatch:
    case Strategy::kSampling:
    case Strategy::kPropagation:
      return LoopOptionsOf(options).MaxTestsForSampling(num_images);
    case Strategy::kRetrieval:
    case Strategy::kBriad:
      return RetrievalOptionsOf(options).num_images;
    case Strategy::kBestFirst:
      return 10;  // Most images are tested with no more of their lists.
    case Strategy::kExhaustive:
      break;
  }
  throw std::logic_error("A strategy that ranks no images draws none.");
}

std::string LoopKey(const PipelineOptions& options, const PairRestrictions& restrictions) {
  const std::string inliers =
      ", inliers " + std::to_string(options.verification.geometry.min_num_inliers);
  if (options.strategy == Strategy::kBestFirst) {
    BestFirstOptions best_first = options.best_first;
    best_first.restrictions = restrictions;
    return "best first: " + best_first.Key() + inliers;
  }
  GraphMatchOptions graph = LoopOptionsOf(options);
  graph.restrictions = restrictions;
  return "loop: " + graph.Key() + inliers;
}

std::unique_ptr<PairProposer> MakeProposer(const PipelineOptions& options,
                                           const ProposerInput& input) {
  if (!options.match_list_path.empty()) {
    return std::make_unique<ListedPairsProposer>(input.listed_pairs, input.image_ids,
                                                 input.restrictions);
  }
  switch (options.strategy) {
    case Strategy::kGraphMatch:
    case Strategy::kSampling:
    case Strategy::kPropagation: {
      GraphMatchOptions graph = LoopOptionsOf(options);
      graph.restrictions = input.restrictions;
      return std::make_unique<GraphMatchProposer>(graph, *input.ranking, input.threads);
    }
    case Strategy::kRetrieval:
    case Strategy::kBriad: {
      RetrievalOptions retrieval = RetrievalOptionsOf(options);
      retrieval.restrictions = input.restrictions;
      return std::make_unique<RetrievalProposer>(retrieval, *input.ranking, input.threads);
    }
    case Strategy::kBestFirst: {
      BestFirstOptions best_first = options.best_first;
      best_first.restrictions = input.restrictions;
      return std::make_unique<BestFirstProposer>(best_first, *input.ranking, input.priors,
                                                 input.threads);
    }
    case Strategy::kExhaustive:
      return std::make_unique<AllPairsProposer>(input.restrictions);
  }
  throw std::logic_error("There is no such strategy.");
}

}  // namespace colmap_graphmatch
