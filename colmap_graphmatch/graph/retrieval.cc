#include "colmap_graphmatch/graph/retrieval.h"

#include <algorithm>
#include <string>
#include <utility>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

// Calls propose(vertex, &partners) for every query image, in parallel, and unites what it
// proposes: ascending, each pair once, without pairs of one frame.
template <typename Propose>
std::vector<VertexPair> Unite(std::size_t num_vertices, const PairRestrictions& restrictions,
                              ThreadPool& threads, const Propose& propose) {
  std::vector<std::vector<VertexPair>> proposals(num_vertices);
  threads.ParallelFor(num_vertices, [&](std::size_t i) {
    const auto vertex = static_cast<Vertex>(i);
    if (!restrictions.IsQuery(vertex)) return;
    std::vector<Vertex> partners;
    propose(vertex, &partners);
    std::sort(partners.begin(), partners.end());
    partners.erase(std::unique(partners.begin(), partners.end()), partners.end());
    for (const Vertex partner : partners) {
      if (partner == vertex || restrictions.SameFrame(vertex, partner)) continue;
      proposals[i].push_back(MakeVertexPair(vertex, partner));
    }
  });
  return UniteProposals(proposals);
}

}  // namespace

void RetrievalOptions::Check() const {
  if (num_images < 1) {
    throw OptionsError("num_images is " + std::to_string(num_images) +
                       "; at least 1 image has to be retrieved.");
  }
  if (num_expansions < 0) {
    throw OptionsError("num_expansions is " + std::to_string(num_expansions) +
                       "; it must be at least 0.");
  }
}

std::vector<VertexPair> RetrievePairs(const RetrievalOptions& options, const Ranking& ranking,
                                      ThreadPool& threads) {
  const std::size_t num_vertices = ranking.NumVertices();
  return Unite(num_vertices, options.restrictions, threads,
               [&](Vertex vertex, std::vector<Vertex>* partners) {
                 const auto num = static_cast<std::size_t>(options.num_images);
                 *partners = ranking.NearestOf(vertex);
                 if (partners->size() < std::min(num, num_vertices - 1)) {
                   *partners = ranking.AllOf(vertex);
                 }
                 partners->resize(std::min(num, partners->size()));
               });
}

RetrievalProposer::RetrievalProposer(const RetrievalOptions& options, const Ranking& ranking,
                                     ThreadPool& threads)
    : options_(options), ranking_(ranking), threads_(threads) {
  options.Check();
}

std::vector<VertexPair> RetrievalProposer::Expand(const MatchingGraph& graph) const {
  return Unite(graph.NumVertices(), options_.restrictions, threads_,
               [&](Vertex vertex, std::vector<Vertex>* partners) {
                 for (const Vertex neighbor : graph.Neighbors(vertex)) {
                   for (const Vertex other : graph.Neighbors(neighbor)) {
                     if (!graph.IsTested(vertex, other)) partners->push_back(other);
                   }
                 }
               });
}

std::optional<Proposal> RetrievalProposer::Next(const MatchingGraph& graph) {
  if (graph.NumVertices() != ranking_.NumVertices()) {
    throw OptionsError("Every ranked image needs its id.");
  }
  if (round_ > options_.num_expansions) return std::nullopt;
  const int round = round_++;
  std::vector<VertexPair> pairs =
      round == 0 ? RetrievePairs(options_, ranking_, threads_) : Expand(graph);
  if (!pairs.empty()) {
    return round == 0 ? Proposal{std::move(pairs), LoopStage::kRetrieval, 0}
                      : Proposal{std::move(pairs), LoopStage::kExpansion, round - 1};
  }
  // Nothing was found to expand, and nothing will be.
  round_ = options_.num_expansions + 1;
  return std::nullopt;
}

}  // namespace colmap_graphmatch
