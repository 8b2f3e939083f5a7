#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/graph/matching_graph.h"
#include "colmap_graphmatch/graph/stages.h"

namespace colmap_graphmatch {

// Pairs to be tested next, as one batch.
struct Proposal {
  // Ascending, each once, not empty; none of them is in the graph. Only the order of the batches
  // says what comes first: within one, the verifier tests pairs in an order of its own.
  std::vector<VertexPair> pairs;
  LoopStage stage = LoopStage::kSampling;
  int iteration = 0;
};

// About how many tests are to come after a proposal.
struct ExpectedTests {
  double all = 0;
  double samples = 0;  // Those of them that sampling draws.
};

// Decides which pairs are tested: a strategy. It sees the graph and what became of its proposals,
// and nothing else of the run; what it proposes depends on that alone.
//
// Pairs that earlier runs tested are proposed like all others, in the same batches: they are
// answered from what is known, so a run that goes on after an interruption ends like one that was
// not interrupted.
class PairProposer {
 public:
  virtual ~PairProposer() = default;

  // The next pairs to test; none if it has no more to propose as things stand. That need not be the
  // end: it is asked again if pairs that others had tested join the graph.
  virtual std::optional<Proposal> Next(const MatchingGraph& graph) = 0;

  // A pair of the last proposal was verified, or one that others had tested joins the graph; the
  // graph has it after the next OnTested or OnKnown. Pairs come in any order, so what is made of
  // them must not depend on it. inliers may be called until this returns.
  virtual void OnVerified(const TestedVertexPair& /*pair*/, const InlierReader& /*inliers*/) {}

  // What became of the last proposal, which is in the graph by then.
  virtual void OnTested(const StageStatistics& /*batch*/) {}

  // Pairs that others had tested have joined the graph.
  virtual void OnKnown(const MatchingGraph& /*graph*/) {}

  // For the progress: asked once for a proposal, before it is tested.
  virtual ExpectedTests TestsAfter(const Proposal& /*proposal*/,
                                   const MatchingGraph& /*graph*/) const {
    return {};
  }
};

}  // namespace colmap_graphmatch
