#include "colmap_graphmatch/pipeline/run_verification.h"

#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "colmap_graphmatch/files/finished_graph.h"
#include "colmap_graphmatch/files/text_file.h"
#include "colmap_graphmatch/matching/top_two.h"
#include "colmap_graphmatch/verification/batch_verifier.h"
#include "colmap_graphmatch/verification/chosen_verifier.h"
#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/plan.h"
#include "colmap_graphmatch/verification/replay_verifier.h"
#include "colmap_graphmatch/verification/work_directory.h"

namespace colmap_graphmatch {
namespace {

std::optional<ColmapInstallation> FindColmap(const RunSetup& setup, const WorkDirectory& work) {
  const VerificationOptions& options = setup.options.verification;
  const std::string& path = setup.options.colmap_path;
  if (options.verifier == VerificationOptions::Verifier::kNative) return std::nullopt;
  const bool is_named = path != PipelineOptions().colmap_path;
  if (!is_named && CanDoWithoutColmap(options) && !IsOnPath(path)) {
    setup.messages.warn(
        "There is no COLMAP on the PATH: this program verifies the pairs itself, with almost the "
        "same results. To have COLMAP do it, install it or name it with --colmap_path.");
    return std::nullopt;
  }
  return DetectColmap(path, work.Path(), setup.stop);
}

const char* DescriptionOf(VerificationOptions::Verifier verifier) {
  switch (verifier) {
    case VerificationOptions::Verifier::kNative:
      return "Pairs are verified by this program.";
    case VerificationOptions::Verifier::kScreened:
      return "Pairs are verified by COLMAP, after a fast fit.";
    case VerificationOptions::Verifier::kAuto:  // A plan has made its choice.
    case VerificationOptions::Verifier::kColmap:
      break;
  }
  return "Pairs are verified by COLMAP.";
}

class ByMatching : public RunVerification {
 public:
  explicit ByMatching(RunSetup& setup)
      : database_(*setup.database),
        work_(setup.options.work_path, WorkDirectory::Guard::kGuarded),
        colmap_(FindColmap(setup, work_)),
        plan_(PlanVerification(setup.options.verification, setup.options.num_threads, colmap_)),
        geometry_(setup.options.verification, plan_, colmap_, database_, setup.images, work_.Path(),
                  setup.stop, setup.messages.warn),
        verifier_(setup.options.verification, plan_, geometry_.Get(), database_, setup.images,
                  setup.stop, setup.messages.warn) {
    Announce(setup.messages);
  }

  PairVerifier& Verifier() override { return verifier_; }

  std::variant<VerificationCost, ReplayCost> Cost() const override {
    const MatchingStatistics matching = verifier_.Statistics();
    const FitStatistics fits = geometry_.Fits();
    const ColmapVerifier::Statistics colmap = geometry_.Colmap();
    VerificationCost cost;
    cost.descriptor_matching_seconds = matching.seconds;
    cost.num_matched = matching.num_matched;
    cost.num_image_reads = matching.num_image_reads;
    cost.fit_seconds = fits.seconds;
    cost.num_fitted = fits.num_fitted;
    cost.num_settled = fits.num_settled;
    cost.colmap_seconds = colmap.seconds;
    cost.num_verified = colmap.num_verified;
    cost.num_failed = matching.num_failed;
    return cost;
  }

  void Finish() override { database_.CheckInPlace(); }

 private:
  void Announce(const Messages& messages) const {
    messages.info(
        std::string("Descriptors are matched ") +
        (plan_.matches_here ? std::string("exactly, with ") + TopTwoTarget() + "." : "by COLMAP."));
    if (colmap_) {
      messages.info("COLMAP " + colmap_->Version() + " at " + colmap_->executable.string() + ", " +
                    (plan_.uses_gpu ? "GPU" : "CPU") +
                    ", processes: " + std::to_string(plan_.num_processes) +
                    ", threads in each: " + std::to_string(plan_.threads_per_process) + ".");
    }
    messages.info(DescriptionOf(plan_.verifier));
  }

  Database& database_;
  WorkDirectory work_;
  std::optional<ColmapInstallation> colmap_;  // Nothing, if there is no need of one.
  VerificationPlan plan_;
  ChosenVerifier geometry_;
  BatchVerifier verifier_;
};

class ByReplay : public RunVerification {
 public:
  ByReplay(RunSetup& setup, FinishedGraph graph) : verifier_(std::move(graph.pairs)) {
    std::unordered_map<ImageId, std::size_t> num_features;
    for (const ImageRecord& image : setup.images) num_features[image.id] = image.num_features;
    verifier_.SetInliers(std::move(graph.read_inliers));
    verifier_.SetStop(&setup.stop);
    verifier_.SetCosts(std::move(num_features), setup.threads.NumThreads());
  }

  PairVerifier& Verifier() override { return verifier_; }
  std::optional<double> ModelledSeconds() const override { return verifier_.ModelledSeconds(); }
  std::variant<VerificationCost, ReplayCost> Cost() const override {
    return ReplayCost{verifier_.ModelledSeconds()};
  }

 private:
  ReplayVerifier verifier_;
};

std::unique_ptr<RunVerification> MakeReplay(RunSetup& setup) {
  const std::filesystem::path& path = setup.options.replay_path;
  FinishedGraph graph = ReadFinishedGraph(
      path, setup.images, setup.options.verification.geometry.min_num_inliers, setup.Patience());
  WarnOfSkippedLines(graph, path, "two different images", setup.messages);
  setup.messages.info("Replays the matching graph of " + path.string() + ", with " +
                      std::to_string(graph.num_edges) +
                      " edges: nothing is matched, and nothing is written to the database.");
  return std::make_unique<ByReplay>(setup, std::move(graph));
}

}  // namespace

std::unique_ptr<RunVerification> MakeRunVerification(RunSetup& setup) {
  switch (setup.kind) {
    case RunKind::kReplay:
      return MakeReplay(setup);
    case RunKind::kMatch:
    case RunKind::kCandidates:
      break;
  }
  return std::make_unique<ByMatching>(setup);
}

}  // namespace colmap_graphmatch
