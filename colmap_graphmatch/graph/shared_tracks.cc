#include "colmap_graphmatch/graph/shared_tracks.h"

#include <algorithm>
#include <utility>

#include "colmap_graphmatch/graph/common_bits.h"

namespace colmap_graphmatch {
namespace {

constexpr std::size_t kBits = 64;
// More than any image has: a damaged database may name what is none.
constexpr std::size_t kMaxNumFeatures = std::size_t{1} << 20;

void Set(std::size_t feature, std::vector<std::uint64_t>* features) {
  if (feature >= kMaxNumFeatures) return;
  if (features->size() <= feature / kBits) features->resize(feature / kBits + 1);
  (*features)[feature / kBits] |= std::uint64_t{1} << (feature % kBits);
}

bool IsBeforeVertex(const std::pair<Vertex, std::vector<std::uint64_t>>& entry, Vertex vertex) {
  return entry.first < vertex;
}

}  // namespace

std::size_t SharedTracks::CountShared(const Features& a, const Features& b) {
  return CountCommonBits(a.data(), b.data(), std::min(a.size(), b.size()));
}

void SharedTracks::Add(const VertexPair& pair, const FeatureMatches& inliers) {
  if (inliers.empty()) return;
  Features first;
  Features second;
  for (const FeatureMatch& match : inliers) {
    Set(match.feature1, &first);
    Set(match.feature2, &second);
  }
  AddDirected(pair.first, pair.second, std::move(first));
  AddDirected(pair.second, pair.first, std::move(second));
}

void SharedTracks::AddDirected(Vertex from, Vertex to, Features features) {
  features.shrink_to_fit();
  auto& edges = edges_[from];
  edges.emplace(std::lower_bound(edges.begin(), edges.end(), to, IsBeforeVertex), to,
                std::move(features));
}

const SharedTracks::Features& SharedTracks::Inliers(Vertex vertex, Vertex neighbor) const {
  static const Features none;
  const auto& edges = edges_[vertex];
  const auto found = std::lower_bound(edges.begin(), edges.end(), neighbor, IsBeforeVertex);
  return found == edges.end() || found->first != neighbor ? none : found->second;
}

}  // namespace colmap_graphmatch
