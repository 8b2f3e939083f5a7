#include "colmap_graphmatch/graph/image_priors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <utility>

namespace colmap_graphmatch {
namespace {

// Fewer are no sequence.
constexpr std::size_t kMinSequence = 3;
// Neighbours that are offered: before and after in a sequence, and by position.
constexpr std::size_t kSequenceReach = 2;
constexpr std::size_t kNumNearPositions = 8;
// The distance to this neighbour, counted from 1, is what others are compared with.
constexpr std::size_t kUsualNeighbor = 5;
// GPS is no better, in metres.
constexpr double kBestGps = 1;
// As good as none, where that many images are at one point.
constexpr double kNoDistance = std::numeric_limits<double>::min();
// Beyond it all are equally far.
constexpr double kMostRelativeDistance = 1e4;

// On the ellipsoid of WGS84, in metres. Altitudes of cameras are too wrong to help.
std::array<double, 3> ToCartesian(const std::array<double, 3>& geographic) {
  constexpr double kRadians = 3.14159265358979323846 / 180;
  constexpr double kRadius = 6378137;
  constexpr double kSquaredEccentricity = 6.69437999014e-3;
  const double latitude = geographic[0] * kRadians;
  const double longitude = geographic[1] * kRadians;
  const double sine = std::sin(latitude);
  const double radius = kRadius / std::sqrt(1 - kSquaredEccentricity * sine * sine);
  return {radius * std::cos(latitude) * std::cos(longitude),
          radius * std::cos(latitude) * std::sin(longitude),
          radius * (1 - kSquaredEccentricity) * sine};
}

bool IsValid(const PositionPrior& prior) {
  const auto& [x, y, z] = prior.position;
  if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) return false;
  if (prior.system == PositionPrior::System::kCartesian) return true;
  // Cameras without a fix write zeros.
  return std::abs(x) <= 90 && std::abs(y) <= 180 && !(x == 0 && y == 0);
}

// The name with its last number taken out, and that number. No number: an empty name.
std::pair<std::string, std::uint64_t> SequenceAndNumber(const std::string& name) {
  constexpr std::size_t kMostDigits = 18;
  const auto is_digit = [&](std::size_t i) { return name[i] >= '0' && name[i] <= '9'; };
  std::size_t end = name.size();
  // Not in the ending: ".jp2".
  const std::size_t dot = name.rfind('.');
  if (dot != std::string::npos && name.find('/', dot) == std::string::npos) end = dot;
  while (end > 0 && !is_digit(end - 1)) --end;
  std::size_t begin = end;
  while (begin > 0 && is_digit(begin - 1) && end - begin < kMostDigits) --begin;
  if (begin == end || name.find('/', end) != std::string::npos) return {};
  return {name.substr(0, begin) + "#" + name.substr(end),
          std::stoull(name.substr(begin, end - begin))};
}

}  // namespace

ImagePriors::ImagePriors(const std::vector<ImageRecord>& images,
                         const std::map<ImageId, PositionPrior>& positions, ThreadPool& threads)
    : places_(images.size()), points_(images.size()), near_(images.size()) {
  FindSequences(images);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto found = positions.find(images[i].id);
    if (found == positions.end() || !IsValid(found->second)) continue;
    Point& point = points_[i];
    point.is_known = true;
    point.system = found->second.system;
    const bool is_geographic = point.system == PositionPrior::System::kGeographic;
    point.position = is_geographic ? ToCartesian(found->second.position) : found->second.position;
    point.usual_distance = std::max(found->second.accuracy, is_geographic ? kBestGps : kNoDistance);
  }
  FindNeighbors(threads);
}

void ImagePriors::FindSequences(const std::vector<ImageRecord>& images) {
  struct Numbered {
    std::string sequence;
    std::uint64_t number = 0;
    Vertex vertex = 0;
    bool operator<(const Numbered& other) const {
      return std::tie(sequence, number, vertex) <
             std::tie(other.sequence, other.number, other.vertex);
    }
  };
  std::vector<Numbered> numbered;
  for (std::size_t i = 0; i < images.size(); ++i) {
    auto [sequence, number] = SequenceAndNumber(images[i].name);
    if (sequence.empty()) continue;
    numbered.push_back({std::move(sequence), number, static_cast<Vertex>(i)});
  }
  std::sort(numbered.begin(), numbered.end());
  std::uint32_t num_sequences = 0;
  for (std::size_t begin = 0; begin < numbered.size();) {
    std::size_t end = begin;
    while (end < numbered.size() && numbered[end].sequence == numbered[begin].sequence) ++end;
    if (end - begin >= kMinSequence) {
      ++num_sequences;
      for (std::size_t i = begin; i < end; ++i) {
        places_[numbered[i].vertex] = {num_sequences, static_cast<std::uint32_t>(i - begin)};
        for (std::size_t step = 1; step <= kSequenceReach; ++step) {
          std::vector<Vertex>& near = near_[numbered[i].vertex][0];
          if (i + step < end) near.push_back(numbered[i + step].vertex);
          if (i >= begin + step) near.push_back(numbered[i - step].vertex);
        }
      }
    }
    begin = end;
  }
}

void ImagePriors::FindNeighbors(ThreadPool& threads) {
  std::vector<Vertex> sorted;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].is_known) sorted.push_back(static_cast<Vertex>(i));
  }
  std::sort(sorted.begin(), sorted.end(), [&](Vertex a, Vertex b) {
    return std::tie(points_[a].system, points_[a].position, a) <
           std::tie(points_[b].system, points_[b].position, b);
  });
  threads.ParallelFor(sorted.size(), [&](std::size_t i) {
    const std::vector<std::pair<double, Vertex>> nearest = NearestOf(i, sorted);
    if (nearest.empty()) return;
    double& usual = points_[sorted[i]].usual_distance;
    usual = std::max(usual, nearest[std::min(kUsualNeighbor, nearest.size()) - 1].first);
    for (const auto& [distance, other] : nearest) near_[sorted[i]][1].push_back(other);
  });
  SetMissingUsualDistances();
}

std::vector<std::pair<double, Vertex>> ImagePriors::NearestOf(
    std::size_t place, const std::vector<Vertex>& sorted) const {
  const Vertex vertex = sorted[place];
  std::vector<std::pair<double, Vertex>> nearest;  // Ascending.
  // Whether what follows in its direction may be nearer than the last of them.
  const auto goes_on = [&](Vertex other) {
    if (!HaveDistance(vertex, other)) return false;
    if (nearest.size() == kNumNearPositions) {
      const double apart = std::abs(points_[vertex].position[0] - points_[other].position[0]);
      if (nearest.back().first == 0 || apart > nearest.back().first) return false;
    }
    const std::pair<double, Vertex> found(Distance(vertex, other), other);
    nearest.insert(std::upper_bound(nearest.begin(), nearest.end(), found), found);
    if (nearest.size() > kNumNearPositions) nearest.pop_back();
    return true;
  };
  std::size_t before = place;
  std::size_t after = place + 1;
  bool has_before = true;
  bool has_after = true;
  while (has_before || has_after) {
    has_before = has_before && before > 0 && goes_on(sorted[--before]);
    has_after = has_after && after < sorted.size() && goes_on(sorted[after++]);
  }
  return nearest;
}

void ImagePriors::SetMissingUsualDistances() {
  // Of GPS there is always one (kBestGps).
  const auto is_cartesian = [](const Point& point) {
    return point.is_known && point.system == PositionPrior::System::kCartesian;
  };
  std::vector<double> known;
  for (const Point& point : points_) {
    if (is_cartesian(point) && point.usual_distance > kNoDistance)
      known.push_back(point.usual_distance);
  }
  if (known.empty()) return;
  const auto middle = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
  std::nth_element(known.begin(), middle, known.end());
  for (Point& point : points_) {
    if (is_cartesian(point) && point.usual_distance <= kNoDistance) point.usual_distance = *middle;
  }
}

bool ImagePriors::HaveDistance(Vertex a, Vertex b) const {
  return points_[a].is_known && points_[b].is_known && points_[a].system == points_[b].system;
}

double ImagePriors::Distance(Vertex a, Vertex b) const {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double difference = points_[a].position[i] - points_[b].position[i];
    sum += difference * difference;
  }
  return std::sqrt(sum);
}

std::array<double, ImagePriors::kNumCues> ImagePriors::Of(Vertex a, Vertex b) const {
  std::array<double, kNumCues> cues = {};
  if (points_.empty()) return cues;
  if (HaveDistance(a, b)) {
    const double usual =
        std::sqrt(points_[a].usual_distance) * std::sqrt(points_[b].usual_distance);
    const double distance = Distance(a, b);
    cues[0] = 1;
    cues[1] = std::log1p(distance < kMostRelativeDistance * usual ? distance / usual
                                                                  : kMostRelativeDistance);
  }
  if (places_[a].sequence != 0 && places_[a].sequence == places_[b].sequence) {
    const auto gap = std::max(places_[a].number, places_[b].number) -
                     std::min(places_[a].number, places_[b].number);
    cues[2] = 1;
    // Not its logarithm: that speaks the louder against a pair the farther it is, and loops would
    // stay open.
    cues[3] = 1 / static_cast<double>(gap);
  }
  return cues;
}

const ImagePriors::Lists& ImagePriors::Near(Vertex vertex) const {
  static const Lists none;
  return near_.empty() ? none : near_[vertex];
}

}  // namespace colmap_graphmatch
