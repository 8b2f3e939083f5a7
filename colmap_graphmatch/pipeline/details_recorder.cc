#include "colmap_graphmatch/pipeline/details_recorder.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

namespace colmap_graphmatch {
namespace {

bool SameBatch(const DiscoveryPoint& a, const DiscoveryPoint& b) {
  return a.stage == b.stage && a.iteration == b.iteration;
}

}  // namespace

void DetailsRecorder::Add(const LoopProgress& progress, double seconds) {
  if (progress.last.is_known) return;
  tested_.push_back(progress.last);
  is_sorted_ = false;
  if (progress.last.outcome == PairOutcome::kFailed) return;

  const DiscoveryPoint point = {progress.stage, progress.iteration, progress.all.num_tested,
                                progress.all.num_edges, seconds};
  const bool ends_batch = last_.num_tested > 0 && !SameBatch(last_, point);
  const bool is_kept = !points_.empty() && points_.back().num_tested == last_.num_tested;
  if (ends_batch && !is_kept) points_.push_back(last_);
  if (point.num_tested % stride_ == 0 || point.num_tested == 1) points_.push_back(point);
  last_ = point;
  if (points_.size() < kMaxPoints) return;
  if (stride_ <= std::numeric_limits<std::size_t>::max() / 4) stride_ *= 2;
  std::vector<DiscoveryPoint> kept;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const bool is_last = i + 1 == points_.size() || !SameBatch(points_[i], points_[i + 1]);
    if (is_last || i == 0 || points_[i].num_tested % stride_ == 0) kept.push_back(points_[i]);
  }
  // So many batches that their ends alone are too many.
  if (kept.size() > kMaxPoints * 3 / 4) {
    for (std::size_t i = 0; 2 * i < kept.size(); ++i) kept[i] = kept[2 * i];
    kept.resize((kept.size() + 1) / 2);
  }
  points_ = std::move(kept);
}

void DetailsRecorder::AddKnown(const std::vector<VerifiedPair>& known,
                               const std::vector<ImageRecord>& images) {
  const auto exists = [&images](ImageId id) {
    const auto place =
        std::lower_bound(images.begin(), images.end(), id,
                         [](const ImageRecord& image, ImageId other) { return image.id < other; });
    return place != images.end() && place->id == id;
  };
  std::copy_if(known.begin(), known.end(), std::back_inserter(tested_),
               [&exists](const VerifiedPair& verified) {
                 return exists(verified.pair.id1) && exists(verified.pair.id2);
               });
  is_sorted_ = false;
}

std::vector<DiscoveryPoint> DetailsRecorder::Discovery() const {
  std::vector<DiscoveryPoint> points = points_;
  if (last_.num_tested > 0 && points.back().num_tested != last_.num_tested) {
    points.push_back(last_);
  }
  return points;
}

const std::vector<VerifiedPair>& DetailsRecorder::Tested() {
  if (!is_sorted_) {
    std::sort(tested_.begin(), tested_.end(),
              [](const VerifiedPair& a, const VerifiedPair& b) { return a.pair < b.pair; });
    is_sorted_ = true;
  }
  return tested_;
}

std::vector<ImageWithoutEdge> FindImagesWithoutEdge(const std::vector<ImageRecord>& images,
                                                    const std::vector<VerifiedPair>& tested,
                                                    const Ranking* ranking,
                                                    const std::vector<ImageId>& ids,
                                                    std::size_t max_num_candidates) {
  std::map<ImageId, ImageWithoutEdge> alone;
  for (const ImageRecord& image : images) alone[image.id].image = image.id;
  for (const VerifiedPair& verified : tested) {
    if (verified.outcome != PairOutcome::kEdge) continue;
    alone.erase(verified.pair.id1);
    alone.erase(verified.pair.id2);
  }
  const auto distance = [&](const ImagePair& pair) {
    const auto a = std::lower_bound(ids.begin(), ids.end(), pair.id1);
    const auto b = std::lower_bound(ids.begin(), ids.end(), pair.id2);
    const bool is_ranked =
        ranking != nullptr && a != ids.end() && b != ids.end() && *a == pair.id1 && *b == pair.id2;
    if (!is_ranked) return std::numeric_limits<double>::infinity();
    return static_cast<double>(ranking->Distance(static_cast<Vertex>(a - ids.begin()),
                                                 static_cast<Vertex>(b - ids.begin())));
  };
  for (const VerifiedPair& verified : tested) {
    for (const auto& [image, other] : {std::make_pair(verified.pair.id1, verified.pair.id2),
                                       std::make_pair(verified.pair.id2, verified.pair.id1)}) {
      const auto found = alone.find(image);
      if (found == alone.end()) continue;
      if (verified.outcome == PairOutcome::kFailed) {
        ++found->second.num_failed;
        continue;
      }
      found->second.candidates.push_back(
          {other, distance(verified.pair), verified.num_inliers, verified.num_matches});
    }
  }
  std::vector<ImageWithoutEdge> result;
  for (auto& [id, image] : alone) {
    auto& candidates = image.candidates;
    // Without distances, what has the most inliers came nearest.
    std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
      return std::tie(a.distance, b.num_inliers, a.image) <
             std::tie(b.distance, a.num_inliers, b.image);
    });
    if (candidates.size() > max_num_candidates) candidates.resize(max_num_candidates);
    result.push_back(std::move(image));
  }
  return result;
}

}  // namespace colmap_graphmatch
