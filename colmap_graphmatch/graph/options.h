#pragma once

#include <cstddef>
#include <string>

#include "colmap_graphmatch/base/enum_words.h"
#include "colmap_graphmatch/graph/pair_restrictions.h"

namespace colmap_graphmatch {

// The parameters of the sample-and-propagate loop. The first four are the paper's, with the values
// it uses for all scenes (supplement, section 2).
struct GraphMatchOptions {
  // Iterations that sample; after them the loop only propagates. At least 0.
  int number_sample_iterations = 10;

  // An image with this many neighbours is not sampled or propagated from any more; others may still
  // reach it. At least 1. Fewer saves tests in dense collections and thins the graph there.
  int max_num_neighbors = 120;

  // Tests that propagation makes along an edge in one iteration, in each direction: so many of the
  // neighbours of B, at most, are tested with A for every edge (A, B). At least 0.
  int num_to_propagate = 4;

  // Tests that sampling may spend on one image, over all iterations. 0: max(min(0.017 N, 120), 10)
  // for N images. More finds links between parts that look different, and costs N tests for each.
  int max_tests_for_sampling = 0;

  // An image that has a neighbour is not sampled any more after so many draws of its own in a row
  // that were no edges. 0: the whole budget is spent. 3 saved 4 to 37 % of all tests and lost up to
  // 1.2 % of the edges where it was tried (docs/evaluation.md).
  int max_failed_samples = 0;

  // Images that are no queries neither draw tests nor are propagated from. RunPipeline sets these
  // itself.
  PairRestrictions restrictions;

  // The number of tests that the formula or max_tests_for_sampling gives for N images.
  int MaxTestsForSampling(std::size_t num_images) const;

  // The number of tests an image may draw in each iteration (counted from 0) that samples:
  // floor(MaxTestsForSampling / number_sample_iterations), at least 1 as long as the budget lasts.
  int TestsInIteration(int iteration, std::size_t num_images) const;

  // Names the values of all fields: equal for equal options alone. The state files of users keep
  // seeds under it, and under another key they are not found. So a new field is written only where
  // it differs from its default: what earlier versions wrote stays valid.
  std::string Key() const;

  // Throws OptionsError.
  void Check() const;
};

// Of the strategy that tests the likeliest pairs next (graph/best_first.h).
struct BestFirstOptions {
  // kEdges: finds all edges. kModel: tests no pair that a model hardly gains by: of two images that
  // have neighbours enough, and enough of them in common. (State files have the numbers.)
  enum class Goal { kEdges, kModel };
  Goal goal = Goal::kEdges;

  // Ends when no pair is as likely to be an edge. Greater than 0 and less than 1.
  double min_edge_probability = 0.01;
  PairRestrictions restrictions;

  // As GraphMatchOptions::Key.
  std::string Key() const;

  // Throws OptionsError.
  void Check() const;
};

inline constexpr EnumWords<BestFirstOptions::Goal, 2> kGoalWords = {
    {{BestFirstOptions::Goal::kEdges, "edges"}, {BestFirstOptions::Goal::kModel, "model"}}};

}  // namespace colmap_graphmatch
