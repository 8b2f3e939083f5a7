#include "colmap_graphmatch/verification/options.h"

#include <algorithm>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/verification/colmap_arguments.h"
#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/in_process.h"

namespace colmap_graphmatch {

void VerificationOptions::Check() const {
  exact.Check();
  geometry.Check();
  if (verifier == Verifier::kNative && NeedsColmap(geometry)) {
    throw OptionsError(
        "Only COLMAP has guided_matching, multiple_models, planar_scene and "
        "filter_stationary_matches: leave them out, or have COLMAP verify (verifier screened or "
        "colmap).");
  }
  if (verifier == Verifier::kNative && matcher == Matcher::kColmap) {
    throw OptionsError(
        "What is verified natively is matched here, too: matcher colmap and "
        "verifier native contradict each other.");
  }
  CheckOwners(colmap_options);
  if (num_processes < 0) {
    throw OptionsError("The number of COLMAP processes must be positive, or 0 to have it chosen.");
  }
  if (max_pairs_per_shard < 1) throw OptionsError("A shard needs at least one pair.");
  if (!(timeout_per_pair > 0)) throw OptionsError("The timeout of a pair must be positive.");
  if (!(lock_timeout >= 0)) throw OptionsError("The lock timeout must not be negative.");
}

VerificationPlan PlanVerification(const VerificationOptions& options, int num_threads,
                                  const ColmapInstallation& colmap) {
  options.Check();
  using Matcher = VerificationOptions::Matcher;
  using Verifier = VerificationOptions::Verifier;
  const bool gpu = options.use_gpu && colmap.has_gpu;
  VerificationPlan plan;
  plan.matches_here =
      options.matcher == Matcher::kExact || (options.matcher == Matcher::kAuto && !gpu);
  if (options.verifier == Verifier::kNative) plan.matches_here = true;
  plan.uses_gpu = gpu && !plan.matches_here;
  const bool in_process = plan.matches_here && !NeedsColmap(options.geometry);
  plan.verifier = in_process ? options.verifier : Verifier::kColmap;
  num_threads = EffectiveNumThreads(num_threads);
  plan.num_processes = options.num_processes > 0 ? options.num_processes
                       : plan.uses_gpu           ? 1
                                                 : num_threads;
  plan.threads_per_process = std::max(1, num_threads / plan.num_processes);
  return plan;
}

}  // namespace colmap_graphmatch
