#include "colmap_graphmatch/graph/matching_graph.h"

#include <algorithm>

namespace colmap_graphmatch {
namespace {

// Sorts what was appended since `old_size` into the list and removes nothing.
void MergeAppended(std::size_t old_size, std::vector<Vertex>* list) {
  const auto middle = list->begin() + static_cast<std::ptrdiff_t>(old_size);
  std::sort(middle, list->end());
  std::inplace_merge(list->begin(), middle, list->end());
}

}  // namespace

std::vector<VertexPair> UniteProposals(const std::vector<std::vector<VertexPair>>& proposals) {
  std::vector<VertexPair> pairs;
  for (const std::vector<VertexPair>& proposal : proposals) {
    pairs.insert(pairs.end(), proposal.begin(), proposal.end());
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

MatchingGraph::MatchingGraph(std::size_t num_vertices)
    : neighbors_(num_vertices), tested_(num_vertices) {}

bool MatchingGraph::IsTested(Vertex a, Vertex b) const {
  // The shorter list of the two is the faster one to search.
  if (tested_[a].size() > tested_[b].size()) std::swap(a, b);
  return std::binary_search(tested_[a].begin(), tested_[a].end(), b);
}

void MatchingGraph::Add(const std::vector<TestedVertexPair>& pairs) {
  std::vector<Vertex> touched;
  for (const TestedVertexPair& tested : pairs) {
    touched.push_back(tested.pair.first);
    touched.push_back(tested.pair.second);
  }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  std::vector<std::pair<std::size_t, std::size_t>> old_sizes;
  old_sizes.reserve(touched.size());
  for (const Vertex vertex : touched) {
    old_sizes.emplace_back(neighbors_[vertex].size(), tested_[vertex].size());
  }

  for (const TestedVertexPair& tested : pairs) {
    const auto [a, b] = tested.pair;
    tested_[a].push_back(b);
    tested_[b].push_back(a);
    if (tested.is_edge) {
      neighbors_[a].push_back(b);
      neighbors_[b].push_back(a);
      edges_.push_back(tested.pair);
    }
  }
  num_tested_ += pairs.size();

  for (std::size_t i = 0; i < touched.size(); ++i) {
    MergeAppended(old_sizes[i].first, &neighbors_[touched[i]]);
    MergeAppended(old_sizes[i].second, &tested_[touched[i]]);
  }
}

}  // namespace colmap_graphmatch
