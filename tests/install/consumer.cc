#include <cstdio>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/version.h"
#include "colmap_graphmatch/graph/explorer.h"
#include "colmap_graphmatch/graph/graphmatch.h"
#include "colmap_graphmatch/matching/descriptor_cache.h"
#include "colmap_graphmatch/matching/descriptor_matcher.h"
#include "colmap_graphmatch/matching/pair_order.h"
#include "colmap_graphmatch/pipeline/graphmatch_pipeline.h"
#include "colmap_graphmatch/verification/replay_verifier.h"

namespace gm = colmap_graphmatch;

namespace {

class Silent : public gm::PipelineObserver {
 public:
  void OnInfo(const std::string& /*message*/) override {}
  void OnWarning(const std::string& /*message*/) override {}
  void OnProgress(const gm::LoopProgress& /*progress*/) override {}
};

}  // namespace

// Three photos in a row, of which the neighbours match: the loop has to find both edges. A
// descriptor matches itself. And the whole pipeline links and reports a database that is not there.
int main() {
  const std::vector<unsigned char> descriptor(gm::kDescriptorDim, 45);
  gm::DescriptorMatcher matcher{gm::DescriptorMatchingOptions()};
  if (matcher.Match({descriptor.data(), 1}, {descriptor.data(), 1}).size() != 1) return 1;

  gm::ThreadPool threads(2);
  const gm::VectorRanking ranking({}, 3, 2, {1, 0, 0.8F, 0.6F, 0, 1}, threads);
  gm::ReplayVerifier verifier({{gm::ImagePair(1, 2), 30}, {gm::ImagePair(2, 3), 40}});
  gm::GraphMatchProposer proposer({}, ranking, threads);
  const gm::ExplorationResult result = gm::Explore(proposer, {1, 2, 3}, verifier, nullptr);
  std::printf("colmap_graphmatch %s: %zu edges\n", gm::kVersion, result.graph.NumEdges());
  if (result.graph.NumEdges() != 2) return 1;

  gm::PipelineOptions options;
  options.database_path = "/nowhere/database.db";
  const gm::StopRequest stop;
  Silent silent;
  try {
    gm::RunPipeline(options, stop, silent);
  } catch (const gm::DatabaseError& error) {
    return std::string(error.what()).find("/nowhere/database.db") == std::string::npos ? 1 : 0;
  }
  return 1;
}
