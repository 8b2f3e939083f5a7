#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

struct ScoredVertex {
  Vertex vertex = 0;
  float score = 0;  // Greater is nearer.
};

// Ranked lists that another program made, e.g. a vocabulary tree. What is not in a list is not
// ranked at all.
class ListRanking : public Ranking {
 public:
  // lists: of every vertex, in any order. Entries of the vertex itself are dropped, and of several
  // entries of one vertex the one of the greatest score is kept. Ties by ascending number. Throws
  // OptionsError if there is a vertex that is not among them, or a score that is not a number.
  explicit ListRanking(std::vector<std::vector<ScoredVertex>> lists);

  std::size_t NumVertices() const override { return lists_.size(); }

  // The negative of the score: the greater one of b in the list of a and of a in the list of b;
  // infinite if neither is listed.
  float Distance(Vertex a, Vertex b) const override;

  const std::vector<Vertex>& NearestOf(Vertex vertex) const override { return lists_[vertex]; }
  std::vector<Vertex> AllOf(Vertex vertex) const override { return lists_[vertex]; }

 private:
  // The score of b in the list of a, or -infinity.
  float Score(Vertex a, Vertex b) const;

  std::vector<std::vector<Vertex>> lists_;         // By descending score.
  std::vector<std::vector<ScoredVertex>> scores_;  // The same by ascending number.
};

}  // namespace colmap_graphmatch
