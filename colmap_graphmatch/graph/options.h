#pragma once

#include <cstddef>

#include "colmap_graphmatch/graph/pair_restrictions.h"

namespace colmap_graphmatch {

// The parameters of the sample-and-propagate loop. The first four are the paper's, with the values
// it uses for all scenes (supplement, section 2). The others are choices that the paper leaves
// open; their defaults are the ones that agree with its figures (docs/design.md).
struct GraphMatchOptions {
  // Iterations that sample; after them the loop only propagates. At least 0.
  int number_sample_iterations = 10;

  // An image with this many neighbours is not sampled or propagated from any more; others may still
  // reach it. At least 1. Fewer saves tests in dense collections and thins the graph there.
  int max_num_neighbors = 120;

  // Images that each neighbour of an image hands on to it in one iteration. At least 0.
  int num_to_propagate = 4;

  // Tests that sampling may spend on one image, over all iterations. 0: max(min(0.017 N, 120), 10)
  // for N images. More finds links between parts that look different, and costs N tests for each.
  int max_tests_for_sampling = 0;

  // How max_tests_for_sampling is spread over the iterations: floor(MaxTests / iterations) in each
  // (at least 1 as long as the budget lasts), the same rounded, or with the remainder carried over
  // so that the whole budget is spent.
  enum class SamplingSchedule { kFloor, kRound, kCarry };
  SamplingSchedule sampling_schedule = SamplingSchedule::kFloor;

  // Whether an image draws its nearest untested ones in each iteration, or goes on in its ranked
  // list by the number of tests, some of which propagation or another image has done by then. The
  // latter tests fewer, and agrees better with the paper's numbers of tests.
  bool sample_untested_only = true;

  // Whether tests of an image that were drawn by other images count against its sampling budget.
  bool count_incoming_tests = false;

  // For an edge (A, B), neighbours C of B are ranked by d(A, C), the distance of the pair to be
  // tested, or by d(B, C).
  enum class PropagationDistance { kSource, kNeighbor };
  PropagationDistance propagation_distance = PropagationDistance::kSource;

  // Whether the best num_to_propagate are taken among the untested candidates, or among all, of
  // which the tested ones are then dropped. The latter tests less and finds far less.
  bool propagate_untested_only = true;

  // Whether each iteration propagates along all edges until nothing untested is left, or only along
  // those that were found since the last one.
  bool propagate_from_new_edges_only = false;

  // Whether sampling ends for good when an iteration of it finds no edge.
  bool stop_sampling_without_edges = false;

  // An image that has a neighbour is not sampled any more after so many draws of its own in a row
  // that were no edges. 0: the whole budget is spent. 3 saved 4 to 37 % of all tests and lost up to
  // 1.2 % of the edges where it was tried (docs/evaluation.md).
  int max_failed_samples = 0;

  // Images that do not seek neither draw tests nor are propagated from.
  PairRestrictions restrictions;

  // The number of tests that the formula or max_tests_for_sampling gives for N images.
  int MaxTestsForSampling(std::size_t num_images) const;

  // The number of tests an image may draw in an iteration (counted from 0), of budget
  // MaxTestsForSampling.
  int TestsInIteration(int iteration, std::size_t num_images) const;

  // The next iteration (counted from 0) that may sample although this one had nothing to test:
  // kCarry with a budget below the number of iterations, or lists that are gone on in.
  // number_sample_iterations if there is none.
  int NextSamplingAfterEmpty(int iteration, std::size_t num_images) const;

  // Throws OptionsError.
  void Check() const;
};

}  // namespace colmap_graphmatch
