// check_matching DATABASE NUM_PAIRS: the exact matcher with every instruction set of this processor
// against the plain reference, on the descriptors of pairs of images of a database. Prints the
// first difference and exits with 1 if there is one.

#include <cstdlib>
#include <iostream>
#include <vector>

#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/matching/descriptor_matcher.h"
#include "tests/support/matching_targets.h"
#include "tests/support/reference_matching.h"

namespace colmap_graphmatch {
namespace {

int Main(const char* path, std::size_t num_pairs) {
  Database database(path, sqlite::Access::kRead, 10);
  const std::vector<ImageRecord> images = WithFeatures(database.ReadImages());
  DescriptorMatcher matcher{DescriptorMatchingOptions()};
  std::size_t num_matches = 0;
  for (std::size_t i = 0; i < num_pairs; ++i) {
    // Neighbours in the list, which often show the same place, and others.
    const ImageRecord& image1 = images[i % images.size()];
    const ImageRecord& image2 = images[(i + 1 + i / 2) % images.size()];
    const Descriptors a = database.ReadDescriptors(image1);
    const Descriptors b = database.ReadDescriptors(image2);
    const DescriptorView view_a{a.data.data(), a.num_rows};
    const DescriptorView view_b{b.data.data(), b.num_rows};
    const std::vector<FeatureMatch> expected =
        ReferenceMatch(DescriptorMatchingOptions(), view_a, view_b);
    num_matches += expected.size();
    for (const MatchingTarget& target : MatchingTargets()) {
      target.Use();
      const std::vector<FeatureMatch> matches = matcher.Match(view_a, view_b);
      if (matches == expected) continue;
      std::cout << target.Name() << " finds " << matches.size() << " matches, not the "
                << expected.size() << " of the reference, in \"" << image1.name << "\" and \""
                << image2.name << "\"\n";
      return 1;
    }
  }
  std::cout << num_pairs << " pairs, " << num_matches << " matches: as the reference\n";
  return num_matches > 0 ? 0 : 1;
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "check_matching DATABASE NUM_PAIRS\n";
    return 1;
  }
  return colmap_graphmatch::Main(argv[1], std::strtoul(argv[2], nullptr, 10));
}
