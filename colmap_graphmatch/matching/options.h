#pragma once

namespace colmap_graphmatch {

// COLMAP's SiftMatchingOptions, with its names and defaults (src/colmap/feature/sift.h).
struct DescriptorMatchingOptions {
  // A match's angle must be smaller than this times the angle to the second best; greater than 0.
  double max_ratio = 0.8;

  // Greatest angle of a match, in radians; greater than 0.
  double max_distance = 0.7;

  // Whether two descriptors must be each other's best, and pass both tests in both directions.
  bool cross_check = true;

  // Features of an image that are matched at most: its first ones, as COLMAP's GPU matcher takes
  // them (its CPU matcher takes all); at least 1.
  int max_num_matches = 32768;

  // Throws OptionsError.
  void Check() const;
};

}  // namespace colmap_graphmatch
