#pragma once

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

// num_threads: the cores that all COLMAP processes together may use, at least 1; -1: all. Throws
// OptionsError.
VerificationPlan PlanVerification(const VerificationOptions& options, int num_threads,
                                  const ColmapInstallation& colmap);

}  // namespace colmap_graphmatch
