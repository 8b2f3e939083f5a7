#include "colmap_graphmatch/graph/pair_evidence.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace colmap_graphmatch {
namespace {

// Enough to make up for the entries of OfVertex.
constexpr std::size_t kVerticesPerEvidenceTask = 64;
// The distance to this place of a list is what others are compared with.
constexpr std::size_t kUsualPlace = 10;

// With a success and a failure that never were, so that few tests say little.
double SuccessRate(std::size_t num_edges, std::size_t num_tested) {
  return (static_cast<double>(num_edges) + 1) / (static_cast<double>(num_tested) + 2);
}

}  // namespace

// What is known of the pairs of one vertex with all others.
class PairEvidence::OfVertex {
 public:
  OfVertex(const PairEvidence& evidence, const MatchingGraph& graph, const SharedTracks& tracks)
      : evidence_(evidence), graph_(graph), tracks_(tracks), entries_(graph.NumVertices()) {}

  void Collect(Vertex a, std::size_t num_nearest, std::vector<Candidate>* candidates) {
    WalkFrom(a);
    const auto add = [&](Vertex c, bool is_of_lonely) {
      candidates->push_back({MakeVertexPair(a, c), CuesWith(a, c, Test::kNone), is_of_lonely});
    };
    for (const Vertex c : touched_) {
      // From the smaller of the two alone.
      if (entries_[c].num_common > 0 && a < c && MayBeTested(a, c)) add(c, false);
    }
    const bool is_lonely = graph_.Degree(a) == 0 && graph_.NumTestedOf(a) < kMaxTestsOfLonely;
    if (!evidence_.restrictions_.IsQuery(a)) return;
    const std::vector<Vertex>& nearest = evidence_.ranking_.NearestOf(a);
    for (std::size_t i = 0; i < nearest.size() && num_nearest > 0; ++i) {
      if (!MayBeTested(a, nearest[i])) continue;
      --num_nearest;
      add(nearest[i], is_lonely);
    }
  }

  // All of one first vertex.
  template <typename Iterator>
  void Describe(Iterator begin, Iterator end, LabelledCues* described) {
    WalkFrom(begin->pair.first);
    for (; begin != end; ++begin, ++described) {
      *described = {CuesWith(begin->pair.first, begin->pair.second,
                             begin->is_edge ? Test::kEdge : Test::kNoEdge),
                    begin->is_edge};
    }
  }

 private:
  struct Entry {
    bool is_touched = false;
    std::uint32_t num_common = 0;   // Neighbours of both,
    std::uint32_t num_failed = 0;   // and of one that were tested in vain with the other.
    std::uint64_t num_shared = 0;   // Tracks, over all common neighbours,
    std::uint64_t most_shared = 0;  // and of the one with the most.
  };

  // Of the pair itself, which the graph has and its cues must not know.
  enum class Test { kNone, kNoEdge, kEdge };

  bool MayBeTested(Vertex a, Vertex c) const {
    return c != a && evidence_.restrictions_.Allows(a, c) && !graph_.IsTested(a, c);
  }

  void Reset() {
    for (const Vertex vertex : touched_) entries_[vertex] = {};
    touched_.clear();
  }

  Entry& Touch(Vertex vertex) {
    Entry& entry = entries_[vertex];
    if (!entry.is_touched) {
      entry.is_touched = true;
      touched_.push_back(vertex);
    }
    return entry;
  }

  // Calls visit for all that were tested with the vertex in vain.
  template <typename Visit>
  void VisitFailed(Vertex vertex, const Visit& visit) const {
    auto neighbor = graph_.Neighbors(vertex).begin();
    const auto end = graph_.Neighbors(vertex).end();
    for (const Vertex tested : graph_.Tested(vertex)) {
      if (neighbor != end && *neighbor == tested) {
        ++neighbor;
      } else {
        visit(tested);
      }
    }
  }

  // Fills the entries.
  void WalkFrom(Vertex a) {
    Reset();
    for (const Vertex b : graph_.Neighbors(a)) {
      for (const Vertex c : graph_.Neighbors(b)) ++Touch(c).num_common;
      VisitFailed(b, [this](Vertex c) { ++Touch(c).num_failed; });
      tracks_.VisitThrough(a, b, [this](Vertex c, std::size_t num_shared) {
        Entry& entry = Touch(c);
        entry.num_shared += num_shared;
        entry.most_shared = std::max<std::uint64_t>(entry.most_shared, num_shared);
      });
    }
    VisitFailed(a, [this](Vertex b) {
      for (const Vertex c : graph_.Neighbors(b)) ++Touch(c).num_failed;
    });
  }

  // Of the last vertex that was walked from, and another.
  Cues CuesWith(Vertex a, Vertex c, Test own) const {
    const std::size_t own_tests = own == Test::kNone ? 0 : 1;
    const std::size_t own_edges = own == Test::kEdge ? 1 : 0;
    const auto degree = [&](Vertex vertex) { return graph_.Degree(vertex) - own_edges; };
    const auto rate = [&](Vertex vertex) {
      return SuccessRate(degree(vertex), graph_.NumTestedOf(vertex) - own_tests);
    };
    const Entry& entry = entries_[c];
    const std::size_t least_degree = std::min(degree(a), degree(c));
    const std::size_t ranks[] = {evidence_.RankOf(a, c), evidence_.RankOf(c, a)};
    const double rates[] = {rate(a), rate(c)};
    const auto num_common = static_cast<double>(entry.num_common);
    const auto num_failed = static_cast<double>(entry.num_failed);
    const auto log = [](std::size_t number) { return std::log1p(static_cast<double>(number)); };
    return {1,
            RelativeDistance(a, c),
            log(std::min(ranks[0], ranks[1])),
            log(std::max(ranks[0], ranks[1])),
            log(entry.most_shared),
            log(entry.num_shared),
            log(entry.num_common),
            num_common / (static_cast<double>(least_degree) + 1),
            num_failed / (num_failed + 2 * num_common + 1),
            std::min(rates[0], rates[1]),
            std::max(rates[0], rates[1])};
  }

  // 1 is usual. So it is where distances are none: scores of other programs may have any sign.
  double RelativeDistance(Vertex a, Vertex c) const {
    const double usual_of_a = evidence_.usual_distances_[a];
    const double usual_of_c = evidence_.usual_distances_[c];
    if (!(usual_of_a > 0 && usual_of_c > 0)) return 1;
    constexpr double kMost = 3;
    return std::clamp(evidence_.ranking_.Distance(a, c) / std::sqrt(usual_of_a * usual_of_c),
                      -kMost, kMost);
  }

  const PairEvidence& evidence_;
  const MatchingGraph& graph_;
  const SharedTracks& tracks_;
  std::vector<Entry> entries_;  // By the other vertex.
  std::vector<Vertex> touched_;
};

PairEvidence::PairEvidence(const Ranking& ranking, const PairRestrictions& restrictions,
                           ThreadPool& threads)
    : ranking_(ranking),
      restrictions_(restrictions),
      threads_(threads),
      places_(ranking.NumVertices()),
      usual_distances_(ranking.NumVertices(), 1) {
  threads_.ParallelFor(ranking.NumVertices(), [&](std::size_t i) {
    const std::vector<Vertex>& nearest = ranking.NearestOf(static_cast<Vertex>(i));
    places_[i].reserve(nearest.size());
    for (const Vertex vertex : nearest) {
      places_[i].emplace_back(vertex, static_cast<std::uint32_t>(places_[i].size()));
    }
    std::sort(places_[i].begin(), places_[i].end());
    if (nearest.empty()) return;
    const Vertex usual = nearest[std::min(kUsualPlace, nearest.size()) - 1];
    usual_distances_[i] = ranking.Distance(static_cast<Vertex>(i), usual);
  });
}

std::size_t PairEvidence::RankOf(Vertex listed, Vertex vertex) const {
  const auto& places = places_[vertex];
  const auto found =
      std::lower_bound(places.begin(), places.end(), std::make_pair(listed, std::uint32_t{0}));
  return found != places.end() && found->first == listed ? found->second : ranking_.NumVertices();
}

std::vector<Candidate> PairEvidence::Collect(std::size_t num_nearest, const MatchingGraph& graph,
                                             const SharedTracks& tracks) const {
  const std::size_t num_vertices = graph.NumVertices();
  const std::size_t num_tasks =
      (num_vertices + kVerticesPerEvidenceTask - 1) / kVerticesPerEvidenceTask;
  std::vector<std::vector<Candidate>> parts(num_tasks);
  threads_.ParallelFor(num_tasks, [&](std::size_t task) {
    OfVertex evidence(*this, graph, tracks);
    const std::size_t end = std::min((task + 1) * kVerticesPerEvidenceTask, num_vertices);
    for (std::size_t i = task * kVerticesPerEvidenceTask; i < end; ++i) {
      evidence.Collect(static_cast<Vertex>(i), num_nearest, &parts[task]);
    }
  });
  std::vector<Candidate> candidates;
  for (const std::vector<Candidate>& part : parts) {
    candidates.insert(candidates.end(), part.begin(), part.end());
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(a.pair, b.is_of_lonely) < std::tie(b.pair, a.is_of_lonely);
  });
  candidates.erase(
      std::unique(candidates.begin(), candidates.end(),
                  [](const Candidate& a, const Candidate& b) { return a.pair == b.pair; }),
      candidates.end());
  return candidates;
}

std::vector<LabelledCues> PairEvidence::Describe(const std::vector<TestedVertexPair>& tested,
                                                 const MatchingGraph& graph,
                                                 const SharedTracks& tracks) const {
  std::vector<LabelledCues> described(tested.size());
  std::vector<std::size_t> starts;  // Of the pairs of each first vertex, and the end.
  for (std::size_t i = 0; i < tested.size(); ++i) {
    if (i == 0 || tested[i].pair.first != tested[i - 1].pair.first) starts.push_back(i);
  }
  starts.push_back(tested.size());
  const std::size_t num_tasks =
      (starts.size() - 1 + kVerticesPerEvidenceTask - 1) / kVerticesPerEvidenceTask;
  threads_.ParallelFor(num_tasks, [&](std::size_t task) {
    OfVertex evidence(*this, graph, tracks);
    const std::size_t end = std::min((task + 1) * kVerticesPerEvidenceTask, starts.size() - 1);
    for (std::size_t i = task * kVerticesPerEvidenceTask; i < end; ++i) {
      const auto at = [&](std::size_t place) {
        return tested.begin() + static_cast<std::ptrdiff_t>(place);
      };
      evidence.Describe(at(starts[i]), at(starts[i + 1]), described.data() + starts[i]);
    }
  });
  return described;
}

}  // namespace colmap_graphmatch
