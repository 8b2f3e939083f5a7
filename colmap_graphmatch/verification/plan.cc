#include "colmap_graphmatch/verification/plan.h"

#include <algorithm>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/verification/in_process.h"

namespace colmap_graphmatch {

VerificationPlan PlanVerification(const VerificationOptions& options, int num_threads,
                                  const std::optional<ColmapInstallation>& colmap) {
  options.Check();
  using Matcher = VerificationOptions::Matcher;
  using Verifier = VerificationOptions::Verifier;
  const bool gpu = options.use_gpu && colmap && colmap->has_gpu;
  VerificationPlan plan;
  plan.matches_here =
      options.matcher == Matcher::kExact || (options.matcher == Matcher::kAuto && !gpu);
  Verifier verifier = options.verifier;
  if (verifier == Verifier::kAuto) verifier = colmap ? Verifier::kScreened : Verifier::kNative;
  if (verifier == Verifier::kNative) plan.matches_here = true;
  plan.uses_gpu = gpu && !plan.matches_here;
  // What COLMAP is to reject by the share of all matches, it has to get with all of them.
  const bool rejects =
      colmap && colmap->RejectsByInlierRatio() && options.geometry.min_inlier_ratio.value_or(0) > 0;
  const bool in_process = plan.matches_here && !NeedsColmap(options.geometry) &&
                          !(rejects && verifier == Verifier::kScreened);
  plan.verifier = in_process ? verifier : Verifier::kColmap;
  num_threads = EffectiveNumThreads(num_threads);
  plan.num_processes = options.num_processes > 0 ? options.num_processes
                       : plan.uses_gpu           ? 1
                                                 : num_threads;
  plan.threads_per_process = std::max(1, num_threads / plan.num_processes);
  return plan;
}

bool CanDoWithoutColmap(const VerificationOptions& options) {
  using Verifier = VerificationOptions::Verifier;
  return options.verifier == Verifier::kNative ||
         (options.verifier == Verifier::kAuto &&
          options.matcher != VerificationOptions::Matcher::kColmap &&
          !NeedsColmap(options.geometry));
}

}  // namespace colmap_graphmatch
