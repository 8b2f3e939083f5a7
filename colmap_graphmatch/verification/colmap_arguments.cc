#include "colmap_graphmatch/verification/colmap_arguments.h"

#include <array>
#include <charconv>
#include <optional>
#include <set>
#include <variant>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/verification/colmap_installation.h"

namespace colmap_graphmatch {
namespace {

using Options = std::map<std::string, std::string>;

// The shortest text that stands for the same number.
template <typename Number>
std::string ToText(Number value) {
  std::array<char, 32> text = {};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return std::string(text.data(), end);
}

std::string ToText(bool value) { return value ? "1" : "0"; }

void AddMatching(const DescriptorMatchingOptions& matching, Options* options) {
  const DescriptorMatchingOptions defaults;
  const auto add = [&](const char* name, auto value, auto default_value) {
    if (value != default_value) (*options)[name] = ToText(value);
  };
  add("max_ratio", matching.max_ratio, defaults.max_ratio);
  add("max_distance", matching.max_distance, defaults.max_distance);
  add("cross_check", matching.cross_check, defaults.cross_check);
  add("max_num_matches", matching.max_num_matches, defaults.max_num_matches);
}

using Member =
    std::variant<std::optional<bool> GeometryOptions::*, std::optional<int> GeometryOptions::*,
                 std::optional<double> GeometryOptions::*>;

struct GeometryOption {
  const char* name;
  Member member;
};

const std::array<GeometryOption, 16> kGeometryOptions = {
    {{"TwoViewGeometry.max_error", &GeometryOptions::max_error},
     {"TwoViewGeometry.confidence", &GeometryOptions::confidence},
     {"TwoViewGeometry.min_inlier_ratio", &GeometryOptions::min_inlier_ratio},
     {"TwoViewGeometry.max_num_trials", &GeometryOptions::max_num_trials},
     {"TwoViewGeometry.random_seed", &GeometryOptions::random_seed},
     {"FeatureMatching.guided_matching", &GeometryOptions::guided_matching},
     {"TwoViewGeometry.multiple_models", &GeometryOptions::multiple_models},
     {"TwoViewGeometry.multiple_ignore_watermark", &GeometryOptions::multiple_ignore_watermark},
     {"TwoViewGeometry.compute_relative_pose", &GeometryOptions::compute_relative_pose},
     {"SiftMatching.planar_scene", &GeometryOptions::planar_scene},
     {"TwoViewGeometry.use_degensac", &GeometryOptions::use_degensac},
     {"TwoViewGeometry.use_sampson_refinement", &GeometryOptions::use_sampson_refinement},
     {"TwoViewGeometry.detect_watermark", &GeometryOptions::detect_watermark},
     {"TwoViewGeometry.watermark_detection_max_error",
      &GeometryOptions::watermark_detection_max_error},
     {"TwoViewGeometry.filter_stationary_matches", &GeometryOptions::filter_stationary_matches},
     {"TwoViewGeometry.stationary_matches_max_error",
      &GeometryOptions::stationary_matches_max_error}}};

// Of the members of VerificationOptions that are not in kGeometryOptions.
constexpr std::array<const char*, 7> kOtherPlaces = {
    "max_ratio",       "max_distance", "cross_check", "max_num_matches",
    "min_num_inliers", "use_gpu",      "num_threads"};

void AddGeometry(const GeometryOptions& geometry, Options* options) {
  for (const GeometryOption& option : kGeometryOptions) {
    std::visit(
        [&](auto member) {
          if (const auto& value = geometry.*member) (*options)[option.name] = ToText(*value);
        },
        option.member);
  }
}

}  // namespace

std::map<std::string, std::string> ColmapOptions(const VerificationOptions& options,
                                                 const VerificationPlan& plan) {
  Options colmap_options = options.colmap_options;
  AddMatching(options.exact.matching, &colmap_options);
  AddGeometry(options.geometry, &colmap_options);
  colmap_options["min_num_inliers"] = ToText(options.geometry.min_num_inliers);
  colmap_options["use_gpu"] = ToText(plan.uses_gpu);
  colmap_options["num_threads"] = ToText(plan.threads_per_process);
  return colmap_options;
}

void CheckOwners(const std::map<std::string, std::string>& colmap_options) {
  std::set<std::string> owned(kOtherPlaces.begin(), kOtherPlaces.end());
  for (const GeometryOption& option : kGeometryOptions) owned.insert(WithoutGroup(option.name));
  for (const auto& [name, value] : colmap_options) {
    if (owned.count(WithoutGroup(name)) == 0) continue;
    throw OptionsError(name + " has a place of its own: it does not belong to colmap_options.");
  }
}

}  // namespace colmap_graphmatch
