#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/image_priors.h"
#include "colmap_graphmatch/graph/options.h"
#include "colmap_graphmatch/graph/pair_proposer.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"
#include "colmap_graphmatch/graph/retrieval.h"
#include "colmap_graphmatch/pipeline/options.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// The strategies that users choose from, as proposers of pairs. A new one is a proposer in graph/,
// a value of PipelineOptions::Strategy with its word (pipeline/options.h), and a case in the
// switches over it: those of strategy.cc, and PipelineOptions::RanksImages.

// Whether what it proposes depends on what it found: then it starts from seeds.
bool StartsFromSeeds(PipelineOptions::Strategy strategy);

// The loop that the options come to; with a strategy that is no loop, of the paper.
GraphMatchOptions LoopOptionsOf(const PipelineOptions& options);

// The retrieval that the options come to; with a strategy that does not retrieve, of kRetrieval.
RetrievalOptions RetrievalOptionsOf(const PipelineOptions& options);

// The images of its ranked list that a strategy that ranks images is likely to test with each of
// num_images images, whatever matches.
int DrawsPerImage(const PipelineOptions& options, std::size_t num_images);

// What the seeds of the loop depend on, apart from the images and their vectors.
std::string LoopKey(const PipelineOptions& options, const PairRestrictions& restrictions);

// What a proposer goes by, besides the options.
struct ProposerInput {
  const std::vector<ImageId>& image_ids;       // By vertex, ascending.
  const PairRestrictions& restrictions;        // By vertex.
  const std::vector<ImagePair>& listed_pairs;  // Those of match_list_path.
  const Ranking* ranking;                      // Of the vertices; null unless images are ranked.
  const ImagePriors& priors;                   // By vertex.
  ThreadPool& threads;
};

// The proposer of a run. ranking, priors and threads must outlive it.
std::unique_ptr<PairProposer> MakeProposer(const PipelineOptions& options,
                                           const ProposerInput& input);

}  // namespace colmap_graphmatch
