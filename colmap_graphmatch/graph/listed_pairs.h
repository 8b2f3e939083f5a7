#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/graph/pair_proposer.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"

namespace colmap_graphmatch {

// Pairs that are given beforehand instead of found. Those that the restrictions do not allow are
// left out.

// All pairs of the vertices, block by block.
class AllPairsProposer : public PairProposer {
 public:
  explicit AllPairsProposer(const PairRestrictions& restrictions) : restrictions_(restrictions) {}

  std::optional<Proposal> Next(const MatchingGraph& graph) override;
  ExpectedTests TestsAfter(const Proposal& proposal, const MatchingGraph& graph) const override;

 private:
  PairRestrictions restrictions_;
  // The first vertices of the two sides of the next block.
  std::size_t first_a_ = 0;
  std::size_t first_b_ = 0;
  double num_gone_ = 0;  // Pairs of the blocks before, allowed or not.
};

// The pairs of a list, in one batch. Pairs of images that have no vertex, pairs of an image with
// itself and repeated pairs are left out.
class ListedPairsProposer : public PairProposer {
 public:
  // image_ids: the image of every vertex, ascending.
  ListedPairsProposer(const std::vector<ImagePair>& pairs, const std::vector<ImageId>& image_ids,
                      const PairRestrictions& restrictions);

  std::optional<Proposal> Next(const MatchingGraph& graph) override;

 private:
  std::vector<VertexPair> pairs_;  // Ascending, until they are proposed.
};

}  // namespace colmap_graphmatch
