// Verifies the pairs of a database that COLMAP verified (and that kept its matches), and compares:
//
//   benchmark_geometry DATABASE [ONE_PAIR_IN]
//
// prints how the verdicts differ, the number of inliers as a ratio, where the time went, and what a
// screen would keep.

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/geometry/two_view.h"

namespace colmap_graphmatch {
namespace {

struct StoredPair {
  ImagePair pair;
  std::vector<PointPair> points;
  std::size_t num_inliers = 0;
  int config = 0;
  std::set<std::size_t> inliers;  // Of the matches.
};

struct Stored {
  std::map<CameraId, Camera> cameras;
  std::map<ImageId, CameraId> camera_of;
  std::vector<StoredPair> pairs;
};

Stored Read(const std::string& path, std::size_t one_in) {
  Stored stored;
  Database database(path, sqlite::Access::kRead, 10);
  sqlite::Connection connection(path, sqlite::Access::kRead, 10);
  stored.cameras = database.ReadCameras();
  for (const auto& [id, camera] : stored.cameras) {
    if (const auto why = WhyNotUsable(camera)) {
      throw std::runtime_error("A camera cannot be used: " + *why);
    }
  }
  std::map<ImageId, Keypoints> keypoints;
  for (const ImageRecord& image : database.ReadImages()) {
    stored.camera_of[image.id] = image.camera_id;
    keypoints[image.id] = database.ReadKeypoints(image);
  }
  sqlite::Statement pairs(connection,
                          "SELECT m.pair_id, m.data, t.rows, t.config, t.data FROM matches m "
                          "JOIN two_view_geometries t ON m.pair_id = t.pair_id "
                          "WHERE m.rows >= 15 ORDER BY m.pair_id");
  std::size_t num = 0;
  while (pairs.Step()) {
    if (num++ % one_in != 0) continue;
    StoredPair pair;
    pair.pair = DecodePair(static_cast<PairId>(pairs.Int(0)));
    const sqlite::Blob data = pairs.CopyBlob(1);
    std::vector<std::uint32_t> matches(data.size() / sizeof(std::uint32_t));
    std::memcpy(matches.data(), data.data(), data.size());
    const Keypoints& points1 = keypoints[pair.pair.id1];
    const Keypoints& points2 = keypoints[pair.pair.id2];
    for (std::size_t i = 0; i + 1 < matches.size(); i += 2) {
      const float* a = points1.data.data() + matches[i] * points1.num_cols;
      const float* b = points2.data.data() + matches[i + 1] * points2.num_cols;
      pair.points.push_back({a[0], a[1], b[0], b[1]});
    }
    pair.num_inliers = static_cast<std::size_t>(pairs.Int(2));
    pair.config = static_cast<int>(pairs.Int(3));
    const sqlite::Blob inlier_data = pairs.CopyBlob(4);
    std::vector<std::uint32_t> inliers(inlier_data.size() / sizeof(std::uint32_t));
    std::memcpy(inliers.data(), inlier_data.data(), inlier_data.size());
    std::set<std::pair<std::uint32_t, std::uint32_t>> are_inliers;
    for (std::size_t i = 0; i + 1 < inliers.size(); i += 2) {
      are_inliers.insert({inliers[i], inliers[i + 1]});
    }
    for (std::size_t i = 0; i + 1 < matches.size(); i += 2) {
      if (are_inliers.count({matches[i], matches[i + 1]}) > 0) pair.inliers.insert(i / 2);
    }
    stored.pairs.push_back(std::move(pair));
  }
  return stored;
}

template <typename T>
T Percentile(std::vector<T> values, double percent) {
  if (values.empty()) return T();
  std::sort(values.begin(), values.end());
  const auto at = static_cast<std::size_t>(percent / 100 * static_cast<double>(values.size() - 1));
  return values[at];
}

struct Group {
  std::vector<double> microseconds;
  double fundamental_trials = 0;
  double essential_trials = 0;
  double homography_trials = 0;
  double num_matches = 0;

  void Add(double time, const TwoViewTrials& trials, std::size_t num) {
    microseconds.push_back(time);
    fundamental_trials += static_cast<double>(trials.fundamental);
    essential_trials += static_cast<double>(trials.essential);
    homography_trials += static_cast<double>(trials.homography);
    num_matches += static_cast<double>(num);
  }

  void Print(const char* name) const {
    const auto num = static_cast<double>(microseconds.size());
    double sum = 0;
    for (const double time : microseconds) sum += time;
    fmt::print("{:<24} {:>6} {:>8.0f} {:>8.0f} {:>8.0f} {:>8.0f} {:>8.0f} {:>8.0f} {:>8.0f}\n",
               name, num, num_matches / num, sum / num, Percentile(microseconds, 50),
               Percentile(microseconds, 95), fundamental_trials / num, essential_trials / num,
               homography_trials / num);
  }
};

void Compare(const Stored& stored) {
  const TwoViewOptions options;
  std::map<std::string, Group> groups;
  std::vector<std::size_t> lost;
  std::vector<std::size_t> won;
  std::vector<double> ratios;
  std::map<std::pair<int, int>, std::size_t> configurations;
  std::size_t num_edges = 0;
  std::size_t num_other_configurations = 0;
  double seconds = 0;
  for (const StoredPair& pair : stored.pairs) {
    const Camera& camera1 = stored.cameras.at(stored.camera_of.at(pair.pair.id1));
    const Camera& camera2 = stored.cameras.at(stored.camera_of.at(pair.pair.id2));
    const double before = ThreadCpuSeconds();
    const TwoViewVerdict geometry =
        VerifyTwoViews({pair.pair, camera1, camera2, pair.points, {}}, options);
    const double time = ThreadCpuSeconds() - before;
    seconds += time;
    const int config = static_cast<int>(geometry.configuration);
    const bool is_edge = IsEdge(geometry.inliers.size(), config, options.min_num_inliers);
    const bool was_edge = IsEdge(pair.num_inliers, pair.config, options.min_num_inliers);
    const bool is_calibrated = camera1.has_prior_focal_length && camera2.has_prior_focal_length;
    groups[std::string(was_edge ? "edges" : "others") + (is_calibrated ? ", calibrated" : "")].Add(
        time * 1e6, geometry.trials, pair.points.size());
    ++configurations[{pair.config, config}];
    if (was_edge) ++num_edges;
    if (was_edge && !is_edge) lost.push_back(pair.num_inliers);
    if (!was_edge && is_edge) won.push_back(geometry.inliers.size());
    if (was_edge && is_edge) {
      ratios.push_back(static_cast<double>(geometry.inliers.size()) /
                       static_cast<double>(pair.num_inliers));
      if (config != pair.config) ++num_other_configurations;
    }
  }
  fmt::print(
      "pairs                    number  matches  mean us   median  95th pc  F trials E trials H "
      "trials\n");
  for (const auto& [name, group] : groups) group.Print(name.c_str());
  fmt::print("{:.2f} ms a pair, {:.2f} s for {} pairs\n\n",
             1e3 * seconds / static_cast<double>(stored.pairs.size()), seconds,
             stored.pairs.size());
  std::sort(lost.begin(), lost.end());
  std::sort(won.begin(), won.end());
  fmt::print("{} edges of COLMAP; only COLMAP's: {}, inliers", num_edges, lost.size());
  for (const std::size_t num : lost) fmt::print(" {}", num);
  fmt::print("\nonly ours: {}, inliers", won.size());
  for (const std::size_t num : won) fmt::print(" {}", num);
  fmt::print("\ninliers, ours / COLMAP's: 5th percentile {:.3f}, median {:.3f}, 95th {:.3f}\n",
             Percentile(ratios, 5), Percentile(ratios, 50), Percentile(ratios, 95));
  fmt::print("{} of {} common edges with another configuration:", num_other_configurations,
             ratios.size());
  for (const auto& [configs, num] : configurations) {
    if (configs.first != configs.second) {
      fmt::print(" {}->{}: {}", configs.first, configs.second, num);
    }
  }
  fmt::print("\n");
}

// What is kept for COLMAP where it has the last word.
void Screen(const Stored& stored) {
  const TwoViewOptions options;
  fmt::print("\nreachable below  edges lost  others settled\n");
  std::map<std::size_t, std::pair<std::size_t, std::size_t>> below;
  std::map<double, std::vector<double>> kept;
  std::map<double, double> share;
  std::size_t num_others = 0;
  for (const StoredPair& pair : stored.pairs) {
    const Camera& camera1 = stored.cameras.at(stored.camera_of.at(pair.pair.id1));
    const Camera& camera2 = stored.cameras.at(stored.camera_of.at(pair.pair.id2));
    const bool is_edge = IsEdge(pair.num_inliers, pair.config, options.min_num_inliers);
    if (!is_edge) ++num_others;
    const ScreenedTwoViews screened =
        ScreenTwoViews({pair.pair, camera1, camera2, pair.points, {}}, options);
    for (std::size_t least = 10; least <= 15; ++least) {
      if (screened.num_inliers < least) ++(is_edge ? below[least].first : below[least].second);
    }
    if (!is_edge) continue;
    for (const double bound : {1.0, 1.25, 1.5, 2.0}) {
      std::size_t num = 0;
      std::size_t num_near = 0;
      for (std::size_t match = 0; match < screened.errors.size(); ++match) {
        if (screened.errors[match] > bound) continue;
        ++num_near;
        num += pair.inliers.count(match);
      }
      kept[bound].push_back(static_cast<double>(num) / static_cast<double>(pair.inliers.size()));
      share[bound] += static_cast<double>(num_near) / static_cast<double>(pair.points.size());
    }
  }
  for (const auto& [least, nums] : below) {
    fmt::print("{:>15}  {:>10}  {:>13.0f} %\n", least, nums.first,
               100 * static_cast<double>(nums.second) / static_cast<double>(num_others));
  }
  fmt::print("bound  COLMAP's inliers kept: mean, 5th percentile; matches of edges kept\n");
  for (const auto& [bound, ratios] : kept) {
    double sum = 0;
    for (const double ratio : ratios) sum += ratio;
    const auto num = static_cast<double>(ratios.size());
    fmt::print("{:>5}  {:.4f}  {:.4f}  {:.3f}\n", bound, sum / num, Percentile(ratios, 5),
               share[bound] / num);
  }
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: benchmark_geometry DATABASE [ONE_PAIR_IN]\n");
    return 1;
  }
  try {
    const std::size_t one_in = argc > 2 ? std::max(1UL, std::strtoul(argv[2], nullptr, 10)) : 1;
    const colmap_graphmatch::Stored stored = colmap_graphmatch::Read(argv[1], one_in);
    colmap_graphmatch::Compare(stored);
    colmap_graphmatch::Screen(stored);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
