#include "colmap_graphmatch/ranking/nearest.h"

#include <algorithm>
#include <numeric>

namespace colmap_graphmatch {

std::vector<Vertex> Nearest(const float* nearness, std::size_t num_vertices, Vertex vertex,
                            std::size_t num_nearest) {
  std::vector<Vertex> order(num_vertices);
  std::iota(order.begin(), order.end(), Vertex{0});
  order.erase(order.begin() + static_cast<std::ptrdiff_t>(vertex));
  const auto nearer = [nearness](Vertex a, Vertex b) {
    return nearness[a] != nearness[b] ? nearness[a] > nearness[b] : a < b;
  };
  if (num_nearest < order.size()) {
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(num_nearest);
    std::nth_element(order.begin(), end, order.end(), nearer);
    order.erase(end, order.end());
  }
  std::sort(order.begin(), order.end(), nearer);
  order.shrink_to_fit();
  return order;
}

}  // namespace colmap_graphmatch
