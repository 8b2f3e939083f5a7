#include "colmap_graphmatch/graph/listed_pairs.h"

#include <algorithm>
#include <utility>

namespace colmap_graphmatch {
namespace {

// Images a block: two blocks make a batch of up to 65,536 pairs, and one image is read at most once
// a batch if the cache holds two blocks.
constexpr std::size_t kImagesPerBlock = 256;

}  // namespace

std::optional<Proposal> AllPairsProposer::Next(const MatchingGraph& graph) {
  const std::size_t num = graph.NumVertices();
  while (first_a_ < num) {
    std::vector<VertexPair> pairs;
    const std::size_t end_a = std::min(first_a_ + kImagesPerBlock, num);
    const std::size_t end_b = std::min(first_b_ + kImagesPerBlock, num);
    for (std::size_t a = first_a_; a < end_a; ++a) {
      for (std::size_t b = std::max(first_b_, a + 1); b < end_b; ++b) {
        const VertexPair pair(static_cast<Vertex>(a), static_cast<Vertex>(b));
        ++num_gone_;
        if (restrictions_.Allows(pair.first, pair.second)) pairs.push_back(pair);
      }
    }
    first_b_ += kImagesPerBlock;
    if (first_b_ >= num) {
      first_a_ += kImagesPerBlock;
      first_b_ = first_a_;
    }
    if (!pairs.empty()) return Proposal{std::move(pairs), LoopStage::kListed, 0};
  }
  return std::nullopt;
}

ExpectedTests AllPairsProposer::TestsAfter(const Proposal& /*proposal*/,
                                           const MatchingGraph& graph) const {
  const auto num = static_cast<double>(graph.NumVertices());
  return {num * (num - 1) / 2 - num_gone_, 0};
}

ListedPairsProposer::ListedPairsProposer(const std::vector<ImagePair>& pairs,
                                         const std::vector<ImageId>& image_ids,
                                         const PairRestrictions& restrictions) {
  const auto vertex = [&image_ids](ImageId image) -> std::optional<Vertex> {
    const auto place = std::lower_bound(image_ids.begin(), image_ids.end(), image);
    if (place == image_ids.end() || *place != image) return std::nullopt;
    return static_cast<Vertex>(place - image_ids.begin());
  };
  for (const ImagePair& pair : pairs) {
    const std::optional<Vertex> a = vertex(pair.id1);
    const std::optional<Vertex> b = vertex(pair.id2);
    if (!a || !b || *a == *b || !restrictions.Allows(*a, *b)) continue;
    pairs_.push_back(MakeVertexPair(*a, *b));
  }
  std::sort(pairs_.begin(), pairs_.end());
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
}

std::optional<Proposal> ListedPairsProposer::Next(const MatchingGraph& /*graph*/) {
  if (pairs_.empty()) return std::nullopt;
  return Proposal{std::exchange(pairs_, {}), LoopStage::kListed, 0};
}

}  // namespace colmap_graphmatch
