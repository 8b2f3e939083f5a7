#include "colmap_graphmatch/verification/options.h"

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/verification/colmap_arguments.h"
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

}  // namespace colmap_graphmatch
