#pragma once

#include <optional>

#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/options.h"

namespace colmap_graphmatch {

// What the options come to with the COLMAP that is installed.
struct VerificationPlan {
  bool matches_here = true;  // Descriptors, by this library.
  bool uses_gpu = false;     // COLMAP does.
  VerificationOptions::Verifier verifier = VerificationOptions::Verifier::kColmap;
  int num_processes = 1;  // Of COLMAP, at a time,
  int threads_per_process = 1;
};

// num_threads: the cores that all COLMAP processes together may use, at least 1; -1: all. colmap:
// nothing if there is none, or no need of one. Throws OptionsError.
VerificationPlan PlanVerification(const VerificationOptions& options, int num_threads,
                                  const std::optional<ColmapInstallation>& colmap);

// Whether pairs can be matched and verified without a COLMAP as well, as far as the options say.
bool CanDoWithoutColmap(const VerificationOptions& options);

}  // namespace colmap_graphmatch
