// benchmark_preemptive DATABASE: what matching the features of the largest scales first would save
// and lose (Wu 2013), for numbers of them and thresholds in matches. DATABASE was matched by
// graphmatch_matcher with its exact matcher; its tested pairs are matched again, its edges are the
// truth.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/largest_scales.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/matching/descriptor_matcher.h"

namespace colmap_graphmatch {
namespace {

constexpr std::size_t kMinNumInliers = 15;
const std::vector<std::size_t> kNumFeatures = {100, 200, 300, 400, 500};
const std::vector<std::size_t> kMinMatches = {1, 2, 3, 4, 6, 8};

struct ImageFeatures {
  Descriptors all;
  std::vector<std::vector<std::uint8_t>> largest_scales;  // By index in kNumFeatures.
};

DescriptorView View(const std::vector<std::uint8_t>& data) {
  return {data.data(), data.size() / kDescriptorDim};
}

struct PairResult {
  bool is_edge = false;
  std::size_t num_inliers = 0;
  bool reaches_colmap = false;
  double seconds = 0;                    // Of matching all features.
  std::vector<std::size_t> num_matches;  // By index in kNumFeatures.
  std::vector<double> preemptive_seconds;
};

void Main(const char* path) {
  Database database(path, sqlite::Access::kRead, 10);
  std::map<ImageId, ImageFeatures> images;
  for (const ImageRecord& image : WithFeatures(database.ReadImages())) {
    ImageFeatures& features = images[image.id];
    features.all = database.ReadDescriptors(image.id);
    const std::vector<float> scales =
        database.ReadKeypoints(image.id).Scales(features.all.num_rows);
    for (const std::size_t num : kNumFeatures) {
      features.largest_scales.push_back(features.all.CopyRows(SelectLargestScales(scales, num)));
    }
  }

  DescriptorMatcher matcher{DescriptorMatchingOptions()};
  std::vector<PairResult> results;
  for (const TestedPair& tested : database.ReadTestedPairs()) {
    if (images.count(tested.pair.id1) + images.count(tested.pair.id2) < 2) continue;
    const ImageFeatures& a = images.at(tested.pair.id1);
    const ImageFeatures& b = images.at(tested.pair.id2);
    PairResult result;
    result.is_edge = IsEdge(tested.num_inliers, tested.config, kMinNumInliers);
    result.num_inliers = tested.num_inliers;
    double start = ThreadCpuSeconds();
    result.reaches_colmap =
        matcher.Match(View(a.all.data), View(b.all.data)).size() >= kMinNumInliers;
    result.seconds = ThreadCpuSeconds() - start;
    for (std::size_t i = 0; i < kNumFeatures.size(); ++i) {
      start = ThreadCpuSeconds();
      result.num_matches.push_back(
          matcher.Match(View(a.largest_scales[i]), View(b.largest_scales[i])).size());
      result.preemptive_seconds.push_back(ThreadCpuSeconds() - start);
    }
    results.push_back(result);
  }

  std::size_t num_edges = 0;
  std::size_t num_to_colmap = 0;
  double seconds = 0;
  for (const PairResult& result : results) {
    num_edges += result.is_edge ? 1U : 0U;
    num_to_colmap += result.reaches_colmap ? 1U : 0U;
    seconds += result.seconds;
  }
  fmt::print("{} pairs, {} reach COLMAP, {} edges; matching all features {:.1f} s ({})\n\n",
             results.size(), num_to_colmap, num_edges, seconds, TopTwoTarget());
  fmt::print(
      "features  matches   given up   matching time   fewer for COLMAP   edges lost   their "
      "inliers: median, most\n");
  for (std::size_t i = 0; i < kNumFeatures.size(); ++i) {
    for (const std::size_t min_matches : kMinMatches) {
      std::size_t num_given_up = 0;
      std::size_t num_spared = 0;
      double time = 0;
      std::vector<std::size_t> lost;
      for (const PairResult& result : results) {
        time += result.preemptive_seconds[i];
        if (result.num_matches[i] >= min_matches) {
          time += result.seconds;
          continue;
        }
        ++num_given_up;
        num_spared += result.reaches_colmap ? 1U : 0U;
        if (result.is_edge) lost.push_back(result.num_inliers);
      }
      std::sort(lost.begin(), lost.end());
      const auto percent = [](std::size_t part, std::size_t whole) {
        return 100 * static_cast<double>(part) /
               static_cast<double>(std::max<std::size_t>(whole, 1));
      };
      fmt::print("{:>8} {:>8} {:>8.1f} % {:>15.3f} {:>16.1f} % {:>10.2f} % {:>12}, {}\n",
                 kNumFeatures[i], min_matches, percent(num_given_up, results.size()),
                 time / seconds, percent(num_spared, num_to_colmap),
                 percent(lost.size(), num_edges), lost.empty() ? 0 : lost[lost.size() / 2],
                 lost.empty() ? 0 : lost.back());
    }
  }
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "benchmark_preemptive DATABASE\n");
    return 1;
  }
  colmap_graphmatch::Main(argv[1]);
  return 0;
}
