#include "colmap_graphmatch/pipeline/run_setup.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/files/pair_list.h"
#include "colmap_graphmatch/files/text_file.h"

namespace colmap_graphmatch {

RunSetup::RunSetup(RunKind run_kind, const PipelineOptions& run_options,
                   const StopRequest& run_stop, PipelineObserver& observer)
    : kind(run_kind),
      options(run_options),
      stop(run_stop),
      messages{[&observer](const std::string& message) { observer.OnInfo(message); },
               [&observer](const std::string& warning) { observer.OnWarning(warning); }},
      threads(run_options.num_threads) {
  WarnOfFewThreads();
  Open();
  WarnOfFewImages();
}

void RunSetup::WarnOfFewThreads() const {
  const int num_wanted = EffectiveNumThreads(options.num_threads);
  if (threads.NumThreads() >= num_wanted) return;
  messages.warn("The system lets this program start fewer threads than the " +
                std::to_string(num_wanted) +
                " that are wanted (ulimit -u, or a limit of the container): it works with "
                "what it gets, and is slower.");
}

void RunSetup::Open() {
  const bool writes = kind == RunKind::kMatch;
  database.emplace(options.database_path,
                   writes ? sqlite::Access::kReadWrite : sqlite::Access::kRead, Patience());
  all_images = database->ReadImages();
  if (writes) database->CheckWritable();
  if (kind != RunKind::kReplay) {
    checkpoint = Checkpoint(options.database_path, Patience(), messages);
  }
  images = WithFeatures(all_images);
  fingerprints = database->ReadFingerprints(images);
  database->ExpectFeatures(images, fingerprints);
}

void RunSetup::WarnOfFewImages() const {
  if (images.size() < all_images.size()) {
    messages.warn(std::to_string(all_images.size() - images.size()) + " of " +
                  std::to_string(all_images.size()) +
                  " images have no features and cannot be matched.");
  }
  if (images.size() == 1) {
    messages.warn("Only one image has features: there is no pair to test.");
  }
}

void RunSetup::ReadLists() {
  if (!options.match_list_path.empty()) {
    PairList list = ReadPairList(options.match_list_path, all_images, &stop);
    WarnOfSkippedLines(list, options.match_list_path, "two different images", messages);
    listed_pairs = std::move(list.pairs);
  }
  if (!options.image_list_path.empty()) {
    ImageList list = ReadImageList(options.image_list_path, images, &stop);
    WarnOfSkippedLines(list, options.image_list_path, "an image", messages);
    query_images = std::move(list.images);
  }
}

ImageRanker RunSetup::MakeRanker() {
  return ImageRanker(options.ranking, options.seed, *database, images, fingerprints, checkpoint,
                     threads, stop, messages);
}

PairRestrictions RunSetup::RestrictionsOf(const std::vector<ImageRecord>& run_images) {
  PairRestrictions restrictions;
  if (!query_images.empty()) {
    for (const ImageRecord& image : run_images) {
      restrictions.queries.push_back(
          std::binary_search(query_images.begin(), query_images.end(), image.id));
    }
  }
  if (options.skip_image_pairs_in_same_frame) {
    const std::map<ImageId, std::uint32_t> frames = database->ReadFrames();
    for (const ImageRecord& image : run_images) {
      const auto frame = frames.find(image.id);
      restrictions.frames.push_back(frame == frames.end() ? 0 : frame->second);
    }
  }
  return restrictions;
}

ImagePriors RunSetup::PriorsOf(const std::vector<ImageRecord>& run_images) {
  std::map<ImageId, PositionPrior> positions;
  try {
    positions = database->ReadPositions();
  } catch (const DatabaseLockedError&) {
    throw;
  } catch (const DatabaseError& error) {
    // Nothing depends on them.
    messages.warn(std::string(error.what()) + " The run goes on without positions of images.");
  }
  return ImagePriors(run_images, positions, threads);
}

sqlite::LockPatience RunSetup::Patience() const {
  return {options.verification.lock_timeout, &stop};
}

}  // namespace colmap_graphmatch
