#include "colmap_graphmatch/verification/options.h"

#include <algorithm>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/verification/colmap_installation.h"

namespace colmap_graphmatch {

const std::string* FindOption(const std::map<std::string, std::string>& options,
                              const std::string& name) {
  for (const auto& [key, value] : options) {
    if (key.substr(key.find('.') + 1) == name) return &value;
  }
  return nullptr;
}

void VerificationOptions::Check() const {
  exact.Check();
  for (const char* name : {"max_ratio", "max_distance", "cross_check", "max_num_matches"}) {
    if (FindOption(colmap_options, name) == nullptr) continue;
    throw OptionsError(std::string(name) + " is an option of exact.matching.");
  }
  if (num_processes < 0) {
    throw OptionsError("The number of COLMAP processes must be positive, or 0 to have it chosen.");
  }
  if (min_num_inliers < 0) throw OptionsError("min_num_inliers must be at least 0.");
  if (max_pairs_per_shard < 1) throw OptionsError("A shard needs at least one pair.");
  if (!(timeout_per_pair > 0)) throw OptionsError("The timeout of a pair must be positive.");
  if (!(lock_timeout >= 0)) throw OptionsError("The lock timeout must not be negative.");
}

VerificationPlan PlanVerification(const VerificationOptions& options, int num_threads,
                                  const ColmapInstallation& colmap) {
  options.Check();
  using Matcher = VerificationOptions::Matcher;
  const bool gpu = options.use_gpu && colmap.has_gpu;
  VerificationPlan plan;
  plan.matches_here =
      options.matcher == Matcher::kExact || (options.matcher == Matcher::kAuto && !gpu);
  plan.uses_gpu = gpu && !plan.matches_here;
  num_threads = EffectiveNumThreads(num_threads);
  plan.num_processes = options.num_processes > 0 ? options.num_processes
                       : plan.uses_gpu           ? 1
                                                 : num_threads;
  plan.threads_per_process = std::max(1, num_threads / plan.num_processes);
  return plan;
}

}  // namespace colmap_graphmatch
