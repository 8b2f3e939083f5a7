#include "colmap_graphmatch/verification/native_verifier.h"

#include <Eigen/Core>
#include <optional>
#include <utility>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/geometry/two_view.h"

namespace colmap_graphmatch {
namespace {

std::optional<Matrix3> RowMajor(const std::optional<Eigen::Matrix3d>& matrix) {
  if (!matrix) return std::nullopt;
  Matrix3 values;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data()) = *matrix;
  return values;
}

}  // namespace

NativeVerifier::NativeVerifier(const GeometryOptions& options, CamerasOfImages cameras,
                               TwoViewConfiguration unmatched)
    : options_(TwoViewOptionsOf(options)), cameras_(std::move(cameras)), unmatched_(unmatched) {}

PairGeometry NativeVerifier::VerifyPair(const PairToVerify& pair) const {
  static const Camera kUnknown;
  const auto camera_of = [this](ImageId image) -> const Camera& {
    const Camera* camera = cameras_.Of(image);
    return camera == nullptr ? kUnknown : *camera;
  };
  PairGeometry result;
  result.pair = pair.pair;
  result.matches = *pair.matches;
  TwoViewGeometry& geometry = result.geometry;
  geometry.configuration = unmatched_;
  const TwoViewVerdict verdict =
      VerifyTwoViews({pair.pair, camera_of(pair.pair.id1), camera_of(pair.pair.id2), pair.points,
                      pair.distinctness},
                     options_);
  if (verdict.inliers.size() < options_.min_num_inliers) return result;
  geometry.configuration = verdict.configuration;
  geometry.inliers.reserve(verdict.inliers.size());
  for (const std::size_t match : verdict.inliers) {
    geometry.inliers.push_back((*pair.matches)[match]);
  }
  geometry.F = RowMajor(verdict.fundamental);
  geometry.E = RowMajor(verdict.essential);
  geometry.H = RowMajor(verdict.homography);
  if (verdict.pose) {
    const Eigen::Vector4d rotation = verdict.pose->Quaternion();
    const Eigen::Vector3d& translation = verdict.pose->translation;
    geometry.pose = RelativePose{{rotation[0], rotation[1], rotation[2], rotation[3]},
                                 {translation[0], translation[1], translation[2]}};
  }
  return result;
}

ShardOutcome NativeVerifier::Verify(const std::vector<PairToVerify>& pairs,
                                    const std::function<bool()>& should_stop) {
  ShardOutcome outcome;
  const double start = ThreadCpuSeconds();
  for (const PairToVerify& pair : pairs) {
    outcome.stopped = should_stop();
    if (outcome.stopped) {
      outcome.results.clear();
      return outcome;
    }
    outcome.results.push_back(VerifyPair(pair));
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  statistics_.seconds += ThreadCpuSeconds() - start;
  statistics_.num_fitted += pairs.size();
  statistics_.num_settled += pairs.size();
  return outcome;
}

FitStatistics NativeVerifier::SoFar() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return statistics_;
}

}  // namespace colmap_graphmatch
