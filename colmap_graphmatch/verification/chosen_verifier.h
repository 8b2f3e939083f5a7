#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/verification/colmap_verifier.h"
#include "colmap_graphmatch/verification/native_verifier.h"
#include "colmap_graphmatch/verification/options.h"
#include "colmap_graphmatch/verification/plan.h"
#include "colmap_graphmatch/verification/screened_verifier.h"

namespace colmap_graphmatch {

// The GeometryVerifier that a plan asks for, and those that it stands on.
class ChosenVerifier {
 public:
  // colmap: none if there is none, which a native verifier does without. For the rest see
  // ColmapVerifier.
  ChosenVerifier(const VerificationOptions& options, const VerificationPlan& plan,
                 const std::optional<ColmapInstallation>& colmap, Database& database,
                 const std::vector<ImageRecord>& images, const std::filesystem::path& work_path,
                 const StopRequest& stop,
                 const std::function<void(const std::string&)>& on_warning);

  GeometryVerifier& Get();

  ColmapVerifier::Statistics Colmap() const;
  FitStatistics Fits() const;

 private:
  std::optional<ColmapVerifier> colmap_;
  std::optional<ScreenedVerifier> screened_;
  std::optional<NativeVerifier> native_;
};

}  // namespace colmap_graphmatch
