#include "colmap_graphmatch/ranking/list_ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {

ListRanking::ListRanking(std::vector<std::vector<ScoredVertex>> lists)
    : lists_(lists.size()), scores_(std::move(lists)) {
  for (std::size_t i = 0; i < scores_.size(); ++i) {
    std::vector<ScoredVertex>& list = scores_[i];
    for (const ScoredVertex& entry : list) {
      if (entry.vertex >= scores_.size() || std::isnan(entry.score)) {
        throw OptionsError("The ranked list of vertex " + std::to_string(i) +
                           " has an entry that is none of the vertices, or has no score.");
      }
    }
    list.erase(std::remove_if(list.begin(), list.end(),
                              [i](const ScoredVertex& entry) { return entry.vertex == i; }),
               list.end());
    std::sort(list.begin(), list.end(), [](const ScoredVertex& a, const ScoredVertex& b) {
      return std::make_pair(a.vertex, -a.score) < std::make_pair(b.vertex, -b.score);
    });
    list.erase(std::unique(list.begin(), list.end(),
                           [](const ScoredVertex& a, const ScoredVertex& b) {
                             return a.vertex == b.vertex;
                           }),
               list.end());
    std::vector<ScoredVertex> by_score = list;
    std::stable_sort(
        by_score.begin(), by_score.end(),
        [](const ScoredVertex& a, const ScoredVertex& b) { return a.score > b.score; });
    for (const ScoredVertex& entry : by_score) lists_[i].push_back(entry.vertex);
  }
}

float ListRanking::Score(Vertex a, Vertex b) const {
  const std::vector<ScoredVertex>& list = scores_[a];
  const auto place = std::lower_bound(
      list.begin(), list.end(), b,
      [](const ScoredVertex& entry, Vertex vertex) { return entry.vertex < vertex; });
  return place != list.end() && place->vertex == b ? place->score
                                                   : -std::numeric_limits<float>::infinity();
}

float ListRanking::Distance(Vertex a, Vertex b) const {
  return -std::max(Score(a, b), Score(b, a));
}

}  // namespace colmap_graphmatch
