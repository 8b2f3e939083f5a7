// benchmark_targets DATABASE PAIRS [RUNS]: CPU seconds for matching the pairs of a list with every
// instruction set of this processor. Medians of RUNS (5) runs, in turn.

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <vector>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/files/pair_list.h"
#include "colmap_graphmatch/matching/descriptor_matcher.h"
#include "tests/support/matching_targets.h"

namespace colmap_graphmatch {
namespace {

void Main(const char* path, const char* list_path, int num_runs) {
  Database database(path, sqlite::Access::kRead, 10);
  const std::vector<ImagePair> pairs = ReadPairList(list_path, database.ReadImages()).pairs;
  std::map<ImageId, Descriptors> images;
  double products = 0;
  const auto read = [&](ImageId image) {
    if (images.count(image) == 0) images[image] = database.ReadDescriptors(image);
    return static_cast<double>(images[image].num_rows);
  };
  for (const ImagePair& pair : pairs) products += read(pair.id1) * read(pair.id2);

  const std::vector<MatchingTarget> targets = MatchingTargets();
  std::vector<std::vector<double>> seconds(targets.size());
  DescriptorMatcher matcher{DescriptorMatchingOptions()};
  for (int run = 0; run < num_runs; ++run) {
    for (std::size_t i = 0; i < targets.size(); ++i) {
      if (targets[i].target == HWY_SCALAR || targets[i].target == HWY_EMU128) continue;
      targets[i].Use();
      const double start = ThreadCpuSeconds();
      for (const ImagePair& pair : pairs) {
        const Descriptors& a = images.at(pair.id1);
        const Descriptors& b = images.at(pair.id2);
        matcher.Match({a.data.data(), a.num_rows}, {b.data.data(), b.num_rows});
      }
      seconds[i].push_back(ThreadCpuSeconds() - start);
    }
  }
  MatchingTarget().Use();
  fmt::print("{} pairs of {:.1f} M products each\n", pairs.size(),
             products / 1e6 / static_cast<double>(std::max<std::size_t>(1, pairs.size())));
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (seconds[i].empty()) continue;
    std::sort(seconds[i].begin(), seconds[i].end());
    fmt::print("{:<22} {:.3f} s\n", targets[i].Name(), seconds[i][seconds[i].size() / 2]);
  }
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "benchmark_targets DATABASE PAIRS [RUNS]\n");
    return 1;
  }
  colmap_graphmatch::Main(argv[1], argv[2], argc > 3 ? std::atoi(argv[3]) : 5);
  return 0;
}
