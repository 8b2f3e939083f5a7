#include "colmap_graphmatch/report/exports.h"

#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/graphml.hpp>
#include <boost/graph/graphviz.hpp>
#include <boost/property_map/dynamic_property_map.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/output_file.h"
#include "colmap_graphmatch/report/matching_graph_view.h"

namespace colmap_graphmatch {
namespace {

struct ImageProperties {
  std::size_t image_id = 0;
  std::string name;
  std::size_t component = 0;  // 1: the largest; 0: the image has no edge.
};

struct EdgeProperties {
  std::size_t inliers = 0;
};

using ExportedGraph = boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS,
                                            ImageProperties, EdgeProperties>;

// What XML and the language of Graphviz can hold: UTF-8 without control characters.
std::string PrintableName(const std::string& name) {
  const nlohmann::json text = name;
  std::string printable =
      nlohmann::json::parse(text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))
          .get<std::string>();
  std::replace_if(
      printable.begin(), printable.end(),
      [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 0x7F; }, '?');
  return printable;
}

ExportedGraph MakeGraph(const RunDetails& details) {
  const std::vector<GraphEdge> edges = EdgesOf(details, ImageIndex(details.images));
  ExportedGraph graph(details.images.size());
  for (std::size_t i = 0; i < details.images.size(); ++i) {
    graph[i] = {details.images[i].id, PrintableName(details.images[i].name), 0};
  }
  std::size_t number = 0;
  for (const std::vector<std::size_t>& component : FindComponents(details.images.size(), edges)) {
    ++number;
    for (const std::size_t image : component) graph[image].component = number;
  }
  for (const GraphEdge& edge : edges) {
    boost::add_edge(edge.a, edge.b, EdgeProperties{edge.num_inliers}, graph);
  }
  return graph;
}

PairListNames WriteList(const std::filesystem::path& path, const std::vector<ImageRecord>& images,
                        const std::vector<ImagePair>& pairs) {
  const ImageIndex index(images);
  PairListNames names;
  WriteWholeFile(path, [&](std::ostream& file) {
    for (const ImagePair& pair : pairs) {
      const std::string& name1 = images[index.Of(pair.id1)].name;
      const std::string& name2 = images[index.Of(pair.id2)].name;
      if ((name1 + name2).find_first_of("\n\r\t") != std::string::npos) {
        ++names.num_left_out;
        continue;
      }
      const bool spaces = (name1 + name2).find(' ') != std::string::npos;
      names.any_spaces = names.any_spaces || spaces;
      file << name1 << (spaces ? '\t' : ' ') << name2 << '\n';
    }
  });
  return names;
}

}  // namespace

PairListNames WritePairList(const std::filesystem::path& path, const RunDetails& details) {
  std::vector<VerifiedPair> edges;
  std::copy_if(details.tested.begin(), details.tested.end(), std::back_inserter(edges),
               [](const VerifiedPair& verified) { return verified.outcome == PairOutcome::kEdge; });
  std::stable_sort(edges.begin(), edges.end(), [](const VerifiedPair& a, const VerifiedPair& b) {
    return a.num_inliers > b.num_inliers;
  });
  std::vector<ImagePair> pairs;
  pairs.reserve(edges.size());
  for (const VerifiedPair& edge : edges) pairs.push_back(edge.pair);
  return WriteList(path, details.images, pairs);
}

PairListNames WritePairList(const std::filesystem::path& path, const CandidateList& candidates) {
  std::vector<ImagePair> pairs;
  pairs.reserve(candidates.pairs.size());
  for (const CandidatePair& candidate : candidates.pairs) pairs.push_back(candidate.pair);
  return WriteList(path, candidates.images, pairs);
}

void WriteGraph(const std::filesystem::path& path, const RunDetails& details) {
  ExportedGraph graph = MakeGraph(details);
  const bool is_dot = path.extension() == ".dot" || path.extension() == ".gv";
  if (is_dot) {
    // Boost escapes quotation marks alone.
    for (std::size_t i = 0; i < boost::num_vertices(graph); ++i) {
      boost::algorithm::replace_all(graph[i].name, "\\", "\\\\");
    }
  }
  boost::dynamic_properties properties;
  properties.property("image_id", boost::get(&ImageProperties::image_id, graph));
  properties.property("component", boost::get(&ImageProperties::component, graph));
  properties.property("inliers", boost::get(&EdgeProperties::inliers, graph));
  properties.property(is_dot ? "label" : "name", boost::get(&ImageProperties::name, graph));
  WriteWholeFile(path, [&](std::ostream& file) {
    if (is_dot) {
      boost::write_graphviz_dp(file, graph, properties, "image_id");
    } else {
      boost::write_graphml(file, graph, properties, true);
    }
  });
}

}  // namespace colmap_graphmatch
