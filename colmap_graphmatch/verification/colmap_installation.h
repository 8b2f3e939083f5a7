#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"

namespace colmap_graphmatch {

// A COLMAP program: what it is and how its options are spelt.
struct ColmapInstallation {
  std::filesystem::path executable;  // Absolute.
  int major = 0;
  int minor = 0;
  int patch = 0;
  bool has_gpu = false;
  // The options of `matches_importer`, e.g. "SiftMatching.use_gpu".
  std::set<std::string> matcher_options;

  std::string Version() const;

  // Whether min_inlier_ratio is more than a budget of trials: pairs with a smaller share of inliers
  // are no edges.
  bool RejectsByInlierRatio() const { return std::make_pair(major, minor) >= std::make_pair(4, 2); }

  // The spelling that this COLMAP has for an option of feature matching or geometric verification,
  // e.g. "TwoViewGeometry.max_error" for "max_error" or "SiftMatching.max_error", or for
  // "default_random_seed"; empty if it has none. COLMAP moved these
  // options between the groups SiftMatching, TwoViewGeometry and FeatureMatching from version to
  // version.
  std::string Spelling(const std::string& option) const;

  // Command-line arguments for options given by their names without a group. Names that this COLMAP
  // does not have are added to `unknown`.
  std::vector<std::string> Arguments(const std::map<std::string, std::string>& options,
                                     std::vector<std::string>* unknown) const;
};

// "max_error" of "TwoViewGeometry.max_error", and what has no group as it is.
std::string WithoutGroup(const std::string& option);

// Whether a program of this name is on the PATH.
bool IsOnPath(const std::string& name);

// Asks the program what it is. colmap_path: a path, or a name to be found on PATH. work_path: a
// directory for what it prints. Throws ColmapError if there is no such program, or if it is not
// COLMAP 3.8 or later; FileError if the disk of work_path is full; StoppedError if stop asks for
// it.
ColmapInstallation DetectColmap(const std::string& colmap_path,
                                const std::filesystem::path& work_path, const StopRequest& stop);

// The end of a program's output, for an error message: long lines are cut, empty ones left out.
std::string LastLines(const std::filesystem::path& output_path, std::size_t num_lines);

}  // namespace colmap_graphmatch
