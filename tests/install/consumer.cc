// Another project's program: a run and a search for candidates on a database that is not there,
// with options of every room. What it includes is installed with all that it includes itself.
#include <cstdio>
#include <string>

#include "colmap_graphmatch/colmap_graphmatch.h"

namespace gm = colmap_graphmatch;

namespace {

class Silent : public gm::PipelineObserver {
 public:
  void OnInfo(const std::string& /*message*/) override {}
  void OnWarning(const std::string& /*message*/) override {}
  void OnProgress(const gm::LoopProgress& progress) override { num_edges = progress.num_edges; }

  std::size_t num_edges = 0;
};

bool NamesDatabase(const gm::DatabaseError& error) {
  return std::string(error.what()).find("/nowhere/database.db") != std::string::npos;
}

// For whoever reads results: all of their parts are complete types.
std::size_t NumEdges(const gm::PipelineResult& result) {
  std::size_t num_edges = 0;
  for (const gm::VerifiedPair& pair : result.details.value_or(gm::RunDetails()).tested) {
    num_edges += pair.outcome == gm::PairOutcome::kEdge ? 1 : 0;
  }
  return num_edges + result.matching.graph.NumEdges();
}

}  // namespace

int main() {
  gm::PipelineOptions options;
  options.database_path = "/nowhere/database.db";
  options.strategy = gm::PipelineOptions::Strategy::kRetrieval;
  options.graph.max_num_neighbors = 60;
  options.ranking.vectors.gmm.num_components = 16;
  options.verification.exact.matching.max_ratio = 0.7;
  options.keep_details = true;
  options.Check();
  const gm::StopRequest stop;
  Silent silent;
  int num_errors = 0;
  try {
    std::printf("%zu edges\n", NumEdges(gm::RunPipeline(options, stop, silent)));
  } catch (const gm::DatabaseError& error) {
    num_errors += NamesDatabase(error) ? 1 : 0;
  }
  try {
    std::printf("%zu candidates\n", gm::FindCandidates(options, stop, silent).pairs.size());
  } catch (const gm::DatabaseError& error) {
    num_errors += NamesDatabase(error) ? 1 : 0;
  }
  std::printf("colmap_graphmatch %s, strategy %s\n", gm::kVersion,
              gm::WordOf(gm::kStrategyWords, options.strategy));
  return num_errors == 2 ? 0 : 1;
}
