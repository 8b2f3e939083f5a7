#include "colmap_graphmatch/verification/chosen_verifier.h"

#include <utility>

namespace colmap_graphmatch {

ChosenVerifier::ChosenVerifier(const VerificationOptions& options, const VerificationPlan& plan,
                               const std::optional<ColmapInstallation>& colmap, Database& database,
                               const std::vector<ImageRecord>& images,
                               const std::filesystem::path& work_path, const StopRequest& stop,
                               const std::function<void(const std::string&)>& on_warning) {
  using Verifier = VerificationOptions::Verifier;
  if (plan.verifier != Verifier::kNative) {
    colmap_.emplace(options, plan, *colmap, database.Path(), images, work_path, stop, on_warning);
  }
  if (plan.verifier == Verifier::kColmap) return;
  CamerasOfImages cameras(images, database.ReadCameras());
  const std::size_t num_unusable = cameras.NumUnusable();
  if (num_unusable > 0) {
    on_warning(std::to_string(num_unusable) +
               " images have cameras that the fast fit cannot work with: " +
               (colmap_ ? "COLMAP gets their pairs as they are."
                        : "their focal lengths count as not known."));
  }
  if (plan.verifier == Verifier::kNative) {
    native_.emplace(options.geometry, std::move(cameras), database.ConfigurationOfUnmatched());
  } else {
    screened_.emplace(options.geometry, std::move(cameras), *colmap_);
  }
}

GeometryVerifier& ChosenVerifier::Get() {
  if (native_) return *native_;
  if (screened_) return *screened_;
  return *colmap_;
}

ColmapVerifier::Statistics ChosenVerifier::Colmap() const {
  return colmap_ ? colmap_->SoFar() : ColmapVerifier::Statistics();
}

ScreenedVerifier::Statistics ChosenVerifier::Screening() const {
  return screened_ ? screened_->SoFar() : ScreenedVerifier::Statistics();
}

}  // namespace colmap_graphmatch
