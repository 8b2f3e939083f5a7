#include "colmap_graphmatch/verification/options.h"

#include <algorithm>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/verification/colmap_arguments.h"

namespace colmap_graphmatch {

void VerificationOptions::Check() const {
  EffectiveNumThreads(num_threads);
  exact.Check();
  geometry.Check();
  CheckOwners(colmap_options);
  if (num_processes < 0) {
    throw OptionsError("The number of COLMAP processes must be positive, or 0 to have it chosen.");
  }
  if (max_pairs_per_shard < 1) throw OptionsError("A shard needs at least one pair.");
  if (!(timeout_per_pair > 0)) throw OptionsError("The timeout of a pair must be positive.");
  if (!(lock_timeout >= 0)) throw OptionsError("The lock timeout must not be negative.");
}

VerificationPlan PlanVerification(const VerificationOptions& options,
                                  const ColmapInstallation& colmap) {
  options.Check();
  using Matcher = VerificationOptions::Matcher;
  const bool gpu = options.use_gpu && colmap.has_gpu;
  VerificationPlan plan;
  plan.matches_here =
      options.matcher == Matcher::kExact || (options.matcher == Matcher::kAuto && !gpu);
  plan.uses_gpu = gpu && !plan.matches_here;
  const int num_threads = EffectiveNumThreads(options.num_threads);
  plan.num_processes = options.num_processes > 0 ? options.num_processes
                       : plan.uses_gpu           ? 1
                                                 : num_threads;
  plan.threads_per_process = std::max(1, num_threads / plan.num_processes);
  return plan;
}

}  // namespace colmap_graphmatch
