#include "colmap_graphmatch/verification/chosen_verifier.h"

#include <cstddef>
#include <string>
#include <utility>

namespace colmap_graphmatch {
namespace {

// A native verifier has no use for some options, and does without them.
void WarnOfColmapsOptions(const GeometryOptions& options,
                          const std::function<void(const std::string&)>& on_warning) {
  std::string names;
  const auto add = [&names](const auto& value, const std::string& name) {
    if (value) names += (names.empty() ? "" : ", ") + name;
  };
  add(options.random_seed, "random_seed");
  add(options.use_degensac, "use_degensac");
  add(options.use_sampson_refinement, "use_sampson_refinement");
  if (names.empty()) return;
  on_warning("Only COLMAP has these options of verification, which have no effect: " + names + ".");
}

// Users look for the mistake in one image, so one is named.
void WarnOfUnusableCameras(const CamerasOfImages& cameras, const std::vector<ImageRecord>& images,
                           const std::string& consequence,
                           const std::function<void(const std::string&)>& on_warning) {
  std::size_t num_unusable = 0;
  std::string first;
  for (const ImageRecord& image : images) {
    const std::optional<std::string> why = cameras.WhyUnusable(image.id);
    if (!why) continue;
    if (num_unusable++ == 0) first = "that of \"" + image.name + "\": " + *why;
  }
  if (num_unusable == 0) return;
  on_warning(std::to_string(num_unusable) +
             " images have cameras that the fast fit cannot work with (the first is " + first +
             "): " + consequence);
}

}  // namespace

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
  WarnOfUnusableCameras(
      cameras, images,
      colmap_ ? "COLMAP gets their pairs as they are." : "their focal lengths count as not known.",
      on_warning);
  if (plan.verifier == Verifier::kNative) {
    WarnOfColmapsOptions(options.geometry, on_warning);
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

FitStatistics ChosenVerifier::Fits() const {
  if (native_) return native_->SoFar();
  return screened_ ? screened_->SoFar() : FitStatistics();
}

}  // namespace colmap_graphmatch
