#include <algorithm>
#include <cstddef>
#include <tuple>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/colmap_graphmatch.h"
#include "colmap_graphmatch/graph/retrieval.h"
#include "colmap_graphmatch/pipeline/run_setup.h"
#include "colmap_graphmatch/pipeline/strategy.h"

namespace colmap_graphmatch {
namespace {

RankedImages RankImages(RunSetup& setup, const std::vector<VerifiedPair>& known) {
  ImageRanker ranker = setup.MakeRanker();
  const VectorModel model = ranker.Learn(known);
  return ranker.Rank(ranker.Encode(model));
}

}  // namespace

CandidateList FindCandidates(const PipelineOptions& options, const StopRequest& stop,
                             PipelineObserver& observer) {
  options.Check();
  if (!options.RanksImages()) {
    throw OptionsError("Only a strategy that ranks images has candidates.");
  }
  if (!options.replay_path.empty()) {
    throw OptionsError("Candidates are what a run would test, and a replay of " +
                       options.replay_path.string() +
                       " tests nothing: leave replay_path empty to find them.");
  }
  const Stopwatch stopwatch;
  RunSetup setup(RunKind::kCandidates, options, stop, observer);
  setup.ReadLists();
  const std::vector<VerifiedPair> known = setup.database->ReadVerifiedPairs(
      static_cast<std::size_t>(options.verification.geometry.min_num_inliers));
  const RankedImages ranked = RankImages(setup, known);
  RetrievalOptions draws;
  draws.num_images = DrawsPerImage(options, ranked.images.size());
  draws.restrictions = setup.RestrictionsOf(ranked.images);

  CandidateList list;
  for (const VertexPair& pair : RetrievePairs(draws, *ranked.ranking, setup.threads)) {
    const ImagePair candidate(ranked.images[pair.first].id, ranked.images[pair.second].id);
    if (FindPair(known, candidate) != nullptr) continue;
    list.pairs.push_back({candidate, ranked.ranking->Distance(pair.first, pair.second)});
  }
  std::sort(list.pairs.begin(), list.pairs.end(),
            [](const CandidatePair& a, const CandidatePair& b) {
              return std::tie(a.distance, a.pair) < std::tie(b.distance, b.pair);
            });
  list.num_per_image = static_cast<std::size_t>(draws.num_images);
  list.num_images_without_features = setup.all_images.size() - setup.images.size();
  list.images = std::move(setup.all_images);
  list.total_seconds = stopwatch.Seconds();
  return list;
}

}  // namespace colmap_graphmatch
