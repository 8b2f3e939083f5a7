#pragma once

#include <map>
#include <string>

#include "colmap_graphmatch/verification/options.h"
#include "colmap_graphmatch/verification/plan.h"

namespace colmap_graphmatch {

// The options as COLMAP is to get them, by names of any version: ColmapInstallation::Arguments
// spells them as the installed one does. Of matching and geometry: what is set and differs from
// COLMAP's defaults.
std::map<std::string, std::string> ColmapOptions(const VerificationOptions& options,
                                                 const VerificationPlan& plan);

// Throws OptionsError if there is an option among them that has a place of its own in
// VerificationOptions: the rest of the program would not know of it.
void CheckOwners(const std::map<std::string, std::string>& colmap_options);

}  // namespace colmap_graphmatch
