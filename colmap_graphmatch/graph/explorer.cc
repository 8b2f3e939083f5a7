#include "colmap_graphmatch/graph/explorer.h"

#include <optional>

#include "colmap_graphmatch/graph/graph_builder.h"

namespace colmap_graphmatch {

ExplorationResult Explore(PairProposer& proposer, const std::vector<ImageId>& image_ids,
                          PairVerifier& verifier, const OnProgress& on_progress,
                          const KnownPairsPolicy& known) {
  GraphBuilder builder(image_ids, verifier, on_progress);
  if (!known.seeds.empty() && builder.AddKnown(known.seeds, proposer))
    proposer.OnKnown(builder.Graph());
  while (builder.Continues()) {
    if (const std::optional<Proposal> proposal = proposer.Next(builder.Graph())) {
      proposer.OnTested(builder.Verify(*proposal, proposer));
    } else if (known.others_join_in_the_end && builder.AddKnown(proposer)) {
      proposer.OnKnown(builder.Graph());
    } else {
      break;
    }
  }
  // A run that was stopped did not get there: what is known is part of its graph, too.
  if (!builder.Continues() && known.others_join_in_the_end) builder.AddKnown(proposer);
  return builder.Finish();
}

}  // namespace colmap_graphmatch
