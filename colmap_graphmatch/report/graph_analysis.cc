#include "colmap_graphmatch/report/graph_analysis.h"

#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/biconnected_components.hpp>
#include <boost/graph/connected_components.hpp>
#include <functional>
#include <map>
#include <utility>

namespace colmap_graphmatch {
namespace {

// With the place of an edge in the list as its index.
using Graph =
    boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS, boost::no_property,
                          boost::property<boost::edge_index_t, std::size_t>>;

Graph MakeGraph(std::size_t num_vertices, const std::vector<GraphEdge>& edges,
                const std::function<bool(const GraphEdge&)>& keeps) {
  Graph graph(num_vertices);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (keeps(edges[i])) boost::add_edge(edges[i].a, edges[i].b, i, graph);
  }
  return graph;
}

bool KeepsAll(const GraphEdge& /*edge*/) { return true; }

// The component of every vertex, counted from 0.
std::vector<std::size_t> LabelComponents(const Graph& graph) {
  std::vector<std::size_t> labels(boost::num_vertices(graph));
  boost::connected_components(graph, labels.data());
  return labels;
}

std::vector<std::size_t> SizesOf(const std::vector<std::size_t>& labels) {
  std::vector<std::size_t> sizes;
  for (const std::size_t label : labels) {
    if (label >= sizes.size()) sizes.resize(label + 1);
    ++sizes[label];
  }
  return sizes;
}

// The tree of blocks (biconnected components) and cut vertices of a graph, rooted in a vertex of
// each component: the vertices of a block but for one, its parent, hang below it.
class BlockTree {
 public:
  BlockTree(const Graph& graph, const std::vector<GraphEdge>& edges) {
    const std::size_t num_vertices = boost::num_vertices(graph);
    std::vector<std::size_t> block_of_edge(edges.size());
    const std::size_t num_blocks = boost::biconnected_components(
        graph, boost::make_iterator_property_map(block_of_edge.begin(),
                                                 boost::get(boost::edge_index, graph)));
    edges_of_block_.resize(num_blocks);
    blocks_of_vertex_.resize(num_vertices);
    std::vector<std::vector<std::size_t>> vertices(num_blocks);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const std::size_t block = block_of_edge[i];
      edges_of_block_[block].push_back(i);
      vertices[block].insert(vertices[block].end(), {edges[i].a, edges[i].b});
    }
    for (std::size_t block = 0; block < num_blocks; ++block) {
      std::sort(vertices[block].begin(), vertices[block].end());
      vertices[block].erase(std::unique(vertices[block].begin(), vertices[block].end()),
                            vertices[block].end());
      for (const std::size_t vertex : vertices[block]) blocks_of_vertex_[vertex].push_back(block);
    }
    vertices_of_block_ = std::move(vertices);
    Measure();
  }

  const std::vector<std::size_t>& BlocksOf(std::size_t vertex) const {
    return blocks_of_vertex_[vertex];
  }
  const std::vector<std::size_t>& EdgesOf(std::size_t block) const {
    return edges_of_block_[block];
  }
  std::size_t NumBlocks() const { return edges_of_block_.size(); }
  std::size_t ParentOf(std::size_t block) const { return parent_of_block_[block]; }

  // Vertices in the block and below it, without its parent.
  std::size_t SizeBelow(std::size_t block) const { return size_below_[block]; }

 private:
  // Numbers of vertices, from the leaves to the roots, without recursion: a chain of photos can be
  // as long as the collection.
  void Measure() {
    const std::size_t num_vertices = blocks_of_vertex_.size();
    parent_of_block_.assign(NumBlocks(), num_vertices);
    size_below_.assign(NumBlocks(), 0);
    std::vector<bool> seen(num_vertices, false);
    std::vector<std::size_t> order;  // Blocks, parents first.
    for (std::size_t root = 0; root < num_vertices; ++root) {
      if (seen[root]) continue;
      seen[root] = true;
      std::vector<std::size_t> open = {root};
      while (!open.empty()) {
        const std::size_t vertex = open.back();
        open.pop_back();
        for (const std::size_t block : blocks_of_vertex_[vertex]) {
          if (parent_of_block_[block] != num_vertices) continue;
          parent_of_block_[block] = vertex;
          order.push_back(block);
          for (const std::size_t other : vertices_of_block_[block]) {
            if (seen[other]) continue;
            seen[other] = true;
            open.push_back(other);
          }
        }
      }
    }
    std::for_each(order.rbegin(), order.rend(), [&](std::size_t block) {
      for (const std::size_t vertex : vertices_of_block_[block]) {
        if (vertex == parent_of_block_[block]) continue;
        ++size_below_[block];
        for (const std::size_t below : blocks_of_vertex_[vertex]) {
          if (below != block) size_below_[block] += size_below_[below];
        }
      }
    });
  }

  std::vector<std::vector<std::size_t>> edges_of_block_;
  std::vector<std::vector<std::size_t>> vertices_of_block_;
  std::vector<std::vector<std::size_t>> blocks_of_vertex_;
  std::vector<std::size_t> parent_of_block_;
  std::vector<std::size_t> size_below_;
};

}  // namespace

std::vector<std::vector<std::size_t>> FindComponents(std::size_t num_vertices,
                                                     const std::vector<GraphEdge>& edges) {
  const std::vector<std::size_t> labels = LabelComponents(MakeGraph(num_vertices, edges, KeepsAll));
  const std::vector<std::size_t> sizes = SizesOf(labels);
  std::vector<std::vector<std::size_t>> components(sizes.size());
  for (std::size_t vertex = 0; vertex < num_vertices; ++vertex) {
    components[labels[vertex]].push_back(vertex);
  }
  components.erase(std::remove_if(components.begin(), components.end(),
                                  [](const auto& component) { return component.size() < 2; }),
                   components.end());
  std::sort(components.begin(), components.end(), [](const auto& a, const auto& b) {
    return a.size() != b.size() ? a.size() > b.size() : a.front() < b.front();
  });
  return components;
}

CutPlaces FindCutPlaces(std::size_t num_vertices, const std::vector<GraphEdge>& edges) {
  const Graph graph = MakeGraph(num_vertices, edges, KeepsAll);
  const std::vector<std::size_t> labels = LabelComponents(graph);
  const std::vector<std::size_t> sizes = SizesOf(labels);
  const BlockTree tree(graph, edges);
  CutPlaces places;
  for (std::size_t vertex = 0; vertex < num_vertices; ++vertex) {
    if (tree.BlocksOf(vertex).size() < 2) continue;
    ArticulationPoint point;
    point.vertex = vertex;
    std::size_t rest = sizes[labels[vertex]] - 1;
    for (const std::size_t block : tree.BlocksOf(vertex)) {
      if (tree.ParentOf(block) != vertex) continue;
      point.parts.push_back(tree.SizeBelow(block));
      rest -= tree.SizeBelow(block);
    }
    if (rest > 0) point.parts.push_back(rest);
    std::sort(point.parts.begin(), point.parts.end(), std::greater<>());
    places.articulation_points.push_back(std::move(point));
  }
  for (std::size_t block = 0; block < tree.NumBlocks(); ++block) {
    if (tree.EdgesOf(block).size() != 1) continue;
    Bridge bridge;
    bridge.edge = tree.EdgesOf(block).front();
    const GraphEdge& edge = edges[bridge.edge];
    const std::size_t below = tree.SizeBelow(block);
    const std::size_t rest = sizes[labels[edge.a]] - below;
    const bool a_is_parent = tree.ParentOf(block) == edge.a;
    bridge.sides = a_is_parent ? std::array<std::size_t, 2>{rest, below}
                               : std::array<std::size_t, 2>{below, rest};
    places.bridges.push_back(bridge);
  }
  std::sort(places.bridges.begin(), places.bridges.end(),
            [](const Bridge& a, const Bridge& b) { return a.edge < b.edge; });
  return places;
}

std::vector<WeakLink> FindWeakLinks(std::size_t num_vertices, const std::vector<GraphEdge>& edges,
                                    std::uint32_t strong_num_inliers, std::size_t min_group_size) {
  const auto is_strong = [&](const GraphEdge& edge) {
    return edge.num_inliers >= strong_num_inliers;
  };
  const std::vector<std::size_t> labels =
      LabelComponents(MakeGraph(num_vertices, edges, is_strong));
  const std::vector<std::size_t> sizes = SizesOf(labels);
  std::map<std::pair<std::size_t, std::size_t>, WeakLink> links;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto [a, b] = std::minmax(labels[edges[i].a], labels[edges[i].b]);
    if (a == b || std::min(sizes[a], sizes[b]) < min_group_size) continue;
    WeakLink& link = links[{a, b}];
    link.groups = {std::max(sizes[a], sizes[b]), std::min(sizes[a], sizes[b])};
    link.edges.push_back(i);
  }
  std::vector<WeakLink> result;
  result.reserve(links.size());
  for (auto& [labels_of_groups, link] : links) result.push_back(std::move(link));
  std::stable_sort(result.begin(), result.end(), [](const WeakLink& a, const WeakLink& b) {
    return std::make_pair(a.groups[1], a.groups[0]) > std::make_pair(b.groups[1], b.groups[0]);
  });
  return result;
}

}  // namespace colmap_graphmatch
