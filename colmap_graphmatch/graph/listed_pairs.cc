#include "colmap_graphmatch/graph/listed_pairs.h"

#include <algorithm>
#include <cstddef>
#include <optional>

#include "colmap_graphmatch/graph/graph_builder.h"

namespace colmap_graphmatch {
namespace {

// Images a block: two blocks make a batch of up to 65,536 pairs, and one image is read at most once
// a batch if the cache holds two blocks.
constexpr std::size_t kImagesPerBlock = 256;

}  // namespace

GraphMatchResult VerifyAllPairs(const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                                const std::function<void(const LoopProgress&)>& on_progress,
                                const PairRestrictions& restrictions) {
  GraphBuilder builder(image_ids, verifier, on_progress);
  const std::size_t num = image_ids.size();
  double num_left = static_cast<double>(num) * static_cast<double>(num > 0 ? num - 1 : 0) / 2;
  for (std::size_t first_a = 0; first_a < num; first_a += kImagesPerBlock) {
    for (std::size_t first_b = first_a; first_b < num; first_b += kImagesPerBlock) {
      std::vector<VertexPair> pairs;
      for (std::size_t a = first_a; a < std::min(first_a + kImagesPerBlock, num); ++a) {
        for (std::size_t b = std::max(first_b, a + 1); b < std::min(first_b + kImagesPerBlock, num);
             ++b) {
          const VertexPair pair(static_cast<Vertex>(a), static_cast<Vertex>(b));
          --num_left;
          if (restrictions.Allows(pair.first, pair.second)) pairs.push_back(pair);
        }
      }
      builder.Verify(LoopStage::kListed, 0, pairs, num_left);
      if (!builder.Continues()) break;
    }
    if (!builder.Continues()) break;
  }
  builder.AddKnown();
  return builder.Finish();
}

GraphMatchResult VerifyListedPairs(const std::vector<ImagePair>& pairs,
                                   const std::vector<ImageId>& image_ids, PairVerifier& verifier,
                                   const std::function<void(const LoopProgress&)>& on_progress,
                                   const PairRestrictions& restrictions) {
  GraphBuilder builder(image_ids, verifier, on_progress);
  const auto vertex = [&image_ids](ImageId image) -> std::optional<Vertex> {
    const auto place = std::lower_bound(image_ids.begin(), image_ids.end(), image);
    if (place == image_ids.end() || *place != image) return std::nullopt;
    return static_cast<Vertex>(place - image_ids.begin());
  };
  std::vector<VertexPair> listed;
  for (const ImagePair& pair : pairs) {
    const std::optional<Vertex> a = vertex(pair.id1);
    const std::optional<Vertex> b = vertex(pair.id2);
    if (!a || !b || *a == *b || !restrictions.Allows(*a, *b)) continue;
    listed.push_back(MakeVertexPair(*a, *b));
  }
  std::sort(listed.begin(), listed.end());
  listed.erase(std::unique(listed.begin(), listed.end()), listed.end());
  builder.Verify(LoopStage::kListed, 0, listed, 0);
  builder.AddKnown();
  return builder.Finish();
}

}  // namespace colmap_graphmatch
