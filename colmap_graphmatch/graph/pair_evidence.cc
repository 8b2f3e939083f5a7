#include "colmap_graphmatch/graph/pair_evidence.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>

#include "colmap_graphmatch/graph/evidence_changes.h"

namespace colmap_graphmatch {
namespace {

// Few enough to make up for what each allocates, enough for the threads of any machine.
constexpr std::size_t kMinVerticesPerTask = 64;
constexpr std::size_t kMaxTasks = 256;
// The distance to this place of a list is what others are compared with.
constexpr std::size_t kUsualPlace = 10;

// With a success and a failure that never were, so that few tests say little.
double SuccessRate(std::size_t num_edges, std::size_t num_tested) {
  return (static_cast<double>(num_edges) + 1) / (static_cast<double>(num_tested) + 2);
}

// The place of an image in the list of another, counted from 0; behind all if it is not listed.
std::uint32_t RankOf(Vertex listed, Vertex vertex, const Ranking& ranking) {
  const std::vector<Vertex>& nearest = ranking.NearestOf(vertex);
  const auto found = std::find(nearest.begin(), nearest.end(), listed);
  return static_cast<std::uint32_t>(found != nearest.end()
                                        ? static_cast<std::size_t>(found - nearest.begin())
                                        : ranking.NumVertices());
}

// Images that are an edge of one of the two and were tested in vain with the other.
std::uint32_t CountFailed(Vertex a, Vertex c, const MatchingGraph& graph) {
  const auto is_edge = [&](Vertex vertex, Vertex other) {
    const std::vector<Vertex>& neighbors = graph.Neighbors(vertex);
    return std::binary_search(neighbors.begin(), neighbors.end(), other);
  };
  std::uint32_t num_failed = 0;
  auto of_a = graph.Tested(a).begin();
  auto of_c = graph.Tested(c).begin();
  while (of_a != graph.Tested(a).end() && of_c != graph.Tested(c).end()) {
    if (*of_a < *of_c) {
      ++of_a;
    } else if (*of_c < *of_a) {
      ++of_c;
    } else {
      if (is_edge(a, *of_a) != is_edge(c, *of_c)) ++num_failed;
      ++of_a;
      ++of_c;
    }
  }
  return num_failed;
}

}  // namespace

struct PairEvidence::Entry {
  Vertex other = 0;
  float distance = 0;
  std::uint32_t least_rank = 0;  // Of one image in the list of the other.
  std::uint32_t most_rank = 0;
  std::uint32_t num_common = 0;   // Neighbours of both,
  std::uint32_t num_failed = 0;   // and of one that were tested in vain with the other.
  std::uint32_t num_shared = 0;   // Tracks, over all common neighbours,
  std::uint32_t most_shared = 0;  // and of the one with the most.
};

PairEvidence::PairEvidence(const Ranking& ranking, const ImagePriors& priors,
                           const PairRestrictions& restrictions, ThreadPool& threads)
    : ranking_(ranking),
      priors_(priors),
      restrictions_(restrictions),
      threads_(threads),
      num_tasks_(std::min((ranking.NumVertices() + kMinVerticesPerTask - 1) / kMinVerticesPerTask,
                          kMaxTasks)),
      usual_distances_(ranking.NumVertices(), 1),
      entries_(ranking.NumVertices()) {
  for (std::size_t i = 0; i < usual_distances_.size(); ++i) {
    const std::vector<Vertex>& nearest = ranking.NearestOf(static_cast<Vertex>(i));
    if (nearest.empty()) continue;
    const Vertex usual = nearest[std::min(kUsualPlace, nearest.size()) - 1];
    usual_distances_[i] = ranking.Distance(static_cast<Vertex>(i), usual);
  }
}

PairEvidence::~PairEvidence() = default;

template <typename Body>
void PairEvidence::ForEachTask(std::size_t size, const Body& body) const {
  threads_.ParallelFor(num_tasks_, [&](std::size_t task) {
    body(task, task * size / num_tasks_, (task + 1) * size / num_tasks_);
  });
}

void PairEvidence::Add(const std::vector<TestedVertexPair>& tests, const MatchingGraph& graph,
                       const SharedTracks& tracks) {
  if (tests.empty()) return;
  MatchingGraph added(graph.NumVertices());
  added.Add(tests);
  ForEachTask(graph.NumVertices(), [&](std::size_t, std::size_t begin, std::size_t end) {
    EvidenceChanges changes(restrictions_, added, graph, tracks);
    for (std::size_t i = begin; i < end; ++i) {
      const auto a = static_cast<Vertex>(i);
      if (restrictions_.IsQuery(a)) Update(a, changes.WalkFrom(a), changes, graph);
    }
  });
}

void PairEvidence::Update(Vertex a, const std::vector<Vertex>& changed,
                          const EvidenceChanges& changes, const MatchingGraph& graph) {
  std::vector<Entry>& entries = entries_[a];
  const std::size_t num_old = entries.size();
  std::size_t i = 0;
  for (const Vertex c : changed) {
    while (i < num_old && entries[i].other < c) ++i;
    const EvidenceChanges::Change& change = changes.To(c);
    if (i < num_old && entries[i].other == c) {
      entries[i].num_common += change.num_common;
      entries[i].num_failed += change.num_failed;
      entries[i].num_shared += change.num_shared;
      entries[i].most_shared = std::max(entries[i].most_shared, change.most_shared);
    } else if (change.num_common > 0 && restrictions_.Allows(a, c)) {
      // Failures before it had a neighbour in common were not counted.
      Entry entry = MakeEntry(a, c, graph);
      entry.num_common = change.num_common;
      entry.num_shared = change.num_shared;
      entry.most_shared = change.most_shared;
      entries.push_back(entry);
    }
  }
  std::inplace_merge(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(num_old),
                     entries.end(),
                     [](const Entry& x, const Entry& y) { return x.other < y.other; });
}

PairEvidence::Entry PairEvidence::MakeEntry(Vertex a, Vertex c, const MatchingGraph& graph) const {
  const std::uint32_t ranks[] = {RankOf(a, c, ranking_), RankOf(c, a, ranking_)};
  Entry entry;
  entry.other = c;
  entry.distance = ranking_.Distance(a, c);
  entry.least_rank = std::min(ranks[0], ranks[1]);
  entry.most_rank = std::max(ranks[0], ranks[1]);
  entry.num_failed = CountFailed(a, c, graph);
  return entry;
}

const PairEvidence::Entry* PairEvidence::Find(Vertex a, Vertex c) const {
  if (!restrictions_.Owns(a, c)) return restrictions_.Owns(c, a) ? Find(c, a) : nullptr;
  const std::vector<Entry>& entries = entries_[a];
  const auto found =
      std::lower_bound(entries.begin(), entries.end(), c,
                       [](const Entry& entry, Vertex vertex) { return entry.other < vertex; });
  return found == entries.end() || found->other != c ? nullptr : &*found;
}

void PairEvidence::VisitCandidates(std::size_t num_nearest, std::size_t num_near,
                                   const MatchingGraph& graph, const Visit& visit) const {
  struct Sample {
    VertexPair pair;
    bool is_of_lonely = false;
  };
  std::vector<std::vector<Sample>> samples_of_tasks(num_tasks_);
  ForEachTask(graph.NumVertices(), [&](std::size_t task, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto a = static_cast<Vertex>(i);
      auto tested = graph.Tested(a).begin();
      for (const Entry& entry : entries_[a]) {
        while (tested != graph.Tested(a).end() && *tested < entry.other) ++tested;
        if (tested != graph.Tested(a).end() && *tested == entry.other) continue;
        visit(task, {MakeVertexPair(a, entry.other), CuesOf(a, entry, OwnTest::kNone, graph),
                     entry.num_common});
      }
      if (!restrictions_.IsQuery(a)) continue;
      const bool is_lonely = graph.Degree(a) == 0 && graph.NumTestedOf(a) < kMaxTestsOfLonely;
      const auto draw = [&](const std::vector<Vertex>& list, std::size_t num_left,
                            bool is_of_lonely) {
        for (const Vertex c : list) {
          if (num_left == 0) break;
          if (!restrictions_.Allows(a, c) || graph.IsTested(a, c)) continue;
          --num_left;
          if (Find(a, c) != nullptr) continue;  // It has been visited.
          samples_of_tasks[task].push_back({MakeVertexPair(a, c), is_of_lonely});
        }
      };
      draw(ranking_.NearestOf(a), num_nearest, is_lonely);
      for (const std::vector<Vertex>& near : priors_.Near(a)) draw(near, num_near, false);
    }
  });
  // Both images of a pair may have drawn it.
  std::vector<Sample> samples;
  for (const std::vector<Sample>& part : samples_of_tasks) {
    samples.insert(samples.end(), part.begin(), part.end());
  }
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) {
    return std::tie(a.pair, b.is_of_lonely) < std::tie(b.pair, a.is_of_lonely);
  });
  samples.erase(std::unique(samples.begin(), samples.end(),
                            [](const Sample& a, const Sample& b) { return a.pair == b.pair; }),
                samples.end());
  ForEachTask(samples.size(), [&](std::size_t task, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      visit(task, {samples[i].pair, Of(samples[i].pair, graph), 0, samples[i].is_of_lonely});
    }
  });
}

Cues PairEvidence::Of(const VertexPair& pair, const MatchingGraph& graph) const {
  const auto [a, entry] = EntryOf(pair, graph);
  return CuesOf(a, entry, OwnTest::kNone, graph);
}

std::vector<LabelledCues> PairEvidence::WithoutThem(const std::vector<TestedVertexPair>& tested,
                                                    const MatchingGraph& graph,
                                                    const SharedTracks& tracks) const {
  std::vector<LabelledCues> described(tested.size());
  ForEachTask(tested.size(), [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& [pair, is_edge] = tested[i];
      auto [a, entry] = EntryOf(pair, graph);
      if (!restrictions_.Allows(pair.first, pair.second)) CountCommon(a, graph, tracks, &entry);
      described[i] = {CuesOf(a, entry, is_edge ? OwnTest::kEdge : OwnTest::kNoEdge, graph),
                      is_edge};
    }
  });
  return described;
}

std::pair<Vertex, PairEvidence::Entry> PairEvidence::EntryOf(const VertexPair& pair,
                                                             const MatchingGraph& graph) const {
  const auto& [a, c] = pair;
  const Entry* found = Find(a, c);
  const Entry entry = found != nullptr ? *found : MakeEntry(a, c, graph);
  return {a == entry.other ? c : a, entry};
}

void PairEvidence::CountCommon(Vertex a, const MatchingGraph& graph, const SharedTracks& tracks,
                               Entry* entry) const {
  std::vector<Vertex> common;
  const std::vector<Vertex>& of_a = graph.Neighbors(a);
  const std::vector<Vertex>& of_c = graph.Neighbors(entry->other);
  std::set_intersection(of_a.begin(), of_a.end(), of_c.begin(), of_c.end(),
                        std::back_inserter(common));
  entry->num_common = static_cast<std::uint32_t>(common.size());
  for (const Vertex b : common) {
    const auto num_shared = static_cast<std::uint32_t>(
        SharedTracks::CountShared(tracks.Inliers(b, a), tracks.Inliers(b, entry->other)));
    entry->num_shared += num_shared;
    entry->most_shared = std::max(entry->most_shared, num_shared);
  }
}

Cues PairEvidence::CuesOf(Vertex a, const Entry& entry, OwnTest own,
                          const MatchingGraph& graph) const {
  const Vertex c = entry.other;
  const std::size_t own_tests = own == OwnTest::kNone ? 0 : 1;
  const std::size_t own_edges = own == OwnTest::kEdge ? 1 : 0;
  const auto degree = [&](Vertex vertex) { return graph.Degree(vertex) - own_edges; };
  const auto rate = [&](Vertex vertex) {
    return SuccessRate(degree(vertex), graph.NumTestedOf(vertex) - own_tests);
  };
  const std::size_t least_degree = std::min(degree(a), degree(c));
  const double rates[] = {rate(a), rate(c)};
  const auto num_common = static_cast<double>(entry.num_common);
  const auto num_failed = static_cast<double>(entry.num_failed);
  const auto prior = priors_.Of(a, c);
  const auto log = [](std::uint32_t number) { return std::log1p(static_cast<double>(number)); };
  return {1,
          RelativeDistance(a, entry),
          log(entry.least_rank),
          log(entry.most_rank),
          log(entry.most_shared),
          log(entry.num_shared),
          log(entry.num_common),
          num_common / (static_cast<double>(least_degree) + 1),
          num_failed / (num_failed + 2 * num_common + 1),
          std::min(rates[0], rates[1]),
          std::max(rates[0], rates[1]),
          prior[0],
          prior[1],
          prior[2],
          prior[3]};
}

// 1 is usual. So it is where distances are none: scores of other programs may have any sign.
double PairEvidence::RelativeDistance(Vertex a, const Entry& entry) const {
  const double usual_of_a = usual_distances_[a];
  const double usual_of_c = usual_distances_[entry.other];
  if (!(usual_of_a > 0 && usual_of_c > 0)) return 1;
  constexpr double kMost = 3;
  return std::clamp(entry.distance / std::sqrt(usual_of_a * usual_of_c), -kMost, kMost);
}

}  // namespace colmap_graphmatch
