#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/position_prior.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// What is known of images beside their looks: where they were taken, and their place in sequences
// of numbered names ("video/frame 0017.jpg"). It is evidence, not a rule: what it is worth, the
// tests of a run say. Const members are thread-safe.
class ImagePriors {
 public:
  static constexpr std::size_t kNumCues = 4;

  // Nothing is known.
  ImagePriors() = default;

  // images: by vertex. A position that cannot be, and latitude and longitude 0, count for none;
  // altitudes of GPS are not looked at. A sequence is three names or more that differ only in the
  // last number of the file's name.
  ImagePriors(const std::vector<ImageRecord>& images,
              const std::map<ImageId, PositionPrior>& positions, ThreadPool& threads);

  // Whether both images have a position, and the logarithm of their distance, compared with what is
  // usual around them; whether both are of one sequence, and 1 over the steps between them there.
  // 0 where something is not known.
  std::array<double, kNumCues> Of(Vertex a, Vertex b) const;

  // The images near one in its sequence, and by position, the nearest first; empty where nothing is
  // known.
  using Lists = std::array<std::vector<Vertex>, 2>;
  const Lists& Near(Vertex vertex) const;

 private:
  struct Place {
    std::uint32_t sequence = 0;  // 0: of none.
    std::uint32_t number = 0;    // Counted without gaps.
  };
  struct Point {
    bool is_known = false;
    PositionPrior::System system = PositionPrior::System::kGeographic;
    std::array<double, 3> position = {0, 0, 0};  // Cartesian.
    double usual_distance = 1;                   // To its neighbours, or how far off it may be.
  };

  void FindSequences(const std::vector<ImageRecord>& images);
  void FindNeighbors(ThreadPool& threads);
  // Distances and vertices of images near the one at this place of a list that is sorted by
  // position: it is left where its first coordinate alone is too far off.
  std::vector<std::pair<double, Vertex>> NearestOf(std::size_t place,
                                                   const std::vector<Vertex>& sorted) const;
  // Where all neighbours are at the same point: what is usual elsewhere.
  void SetMissingUsualDistances();
  bool HaveDistance(Vertex a, Vertex b) const;
  double Distance(Vertex a, Vertex b) const;

  std::vector<Place> places_;
  std::vector<Point> points_;
  std::vector<Lists> near_;
};

}  // namespace colmap_graphmatch
