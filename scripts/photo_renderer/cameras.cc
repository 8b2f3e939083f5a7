#include "scripts/photo_renderer/cameras.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "scripts/photo_renderer/hashing.h"

namespace colmap_graphmatch::synthetic {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr int kNumPhotosOfMonument[] = {14, 13, 15};
constexpr char kCameraTag[] = "# PINHOLE";
constexpr char kColumns[] = "name\tmonument\tcx\tcy\tcz\tqw\tqx\tqy\tqz";

Eigen::Quaterniond LookAt(const Vector3d& center, const Vector3d& target, double roll) {
  Matrix3d rotation;
  const Vector3d forward = (target - center).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  return Eigen::Quaterniond(Eigen::AngleAxisd(roll, Vector3d::UnitZ()) * rotation).normalized();
}

}  // namespace

Truth PlanPhotos(uint32_t seed) {
  Truth truth;
  HashSequence random(Hash(seed, 0xCA3E7Au));
  const auto uniform = [&](double low, double high) {
    return static_cast<double>(random.Uniform(static_cast<float>(low), static_cast<float>(high)));
  };
  int monument = 0;
  for (const int num_photos : kNumPhotosOfMonument) {
    // The middle of the walk faces the front.
    const double mean_step = kPi / 180.0 * 14.0;
    double angle = uniform(-0.4, 0.4) - 0.5 * mean_step * (num_photos - 1);
    const double sway_phase = uniform(0.0, 2.0 * kPi);
    for (int i = 0; i < num_photos; ++i) {
      // Somebody who walks comes nearer and goes away again slowly, rather than at random.
      const double distance = 16.0 + 1.2 * std::sin(0.6 * i + sway_phase) + uniform(-0.4, 0.4);
      const double eye_height =
          2.8 + 1.1 * std::sin(0.9 * i + 2.0 * sway_phase) + uniform(-0.4, 0.4);
      Photo photo;
      photo.monument = monument;
      photo.center = Vector3d(distance * std::cos(angle), distance * std::sin(angle), eye_height);
      const Vector3d target(uniform(-0.6, 0.6), uniform(-0.6, 0.6), 4.3 + uniform(-0.4, 0.4));
      photo.world_to_camera = LookAt(photo.center, target, uniform(-0.07, 0.07));
      truth.photos.push_back(photo);
      angle += mean_step * uniform(0.86, 1.14);
    }
    ++monument;
  }

  // Fisher-Yates rather than std::shuffle, whose outcome the standard leaves open.
  for (size_t i = truth.photos.size() - 1; i > 0; --i) {
    std::swap(truth.photos[i], truth.photos[random.Next() % (i + 1)]);
  }
  for (size_t i = 0; i < truth.photos.size(); ++i) {
    char name[32];
    std::snprintf(name, sizeof(name), "photo_%03zu.jpg", i);
    truth.photos[i].name = name;
  }
  return truth;
}

void WriteTruth(const std::string& path, const Truth& truth) {
  std::ofstream file(path);
  file.precision(std::numeric_limits<double>::max_digits10);
  const Intrinsics& k = truth.intrinsics;
  file << kCameraTag << '\t' << k.fx << ',' << k.fy << ',' << k.cx << ',' << k.cy << '\t' << k.width
       << '\t' << k.height << '\n'
       << kColumns << '\n';
  for (const Photo& photo : truth.photos) {
    const Eigen::Quaterniond& q = photo.world_to_camera;
    file << photo.name << '\t' << photo.monument << '\t' << photo.center.x() << '\t'
         << photo.center.y() << '\t' << photo.center.z() << '\t' << q.w() << '\t' << q.x() << '\t'
         << q.y() << '\t' << q.z() << '\n';
  }
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path);
}

Truth ReadTruth(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  Truth truth;
  std::string line;
  bool has_camera = false;
  for (int line_number = 1; std::getline(file, line); ++line_number) {
    if (line.empty() || line == kColumns) continue;
    bool valid = false;
    if (line.rfind(kCameraTag, 0) == 0) {
      Intrinsics& k = truth.intrinsics;
      valid = has_camera =
          std::sscanf(line.c_str() + sizeof(kCameraTag) - 1, "%lf,%lf,%lf,%lf %d %d", &k.fx, &k.fy,
                      &k.cx, &k.cy, &k.width, &k.height) == 6;
    } else {
      std::istringstream fields(line);
      Photo photo;
      Vector3d& c = photo.center;
      Eigen::Quaterniond& q = photo.world_to_camera;
      valid =
          std::getline(fields, photo.name, '\t') &&
          fields >> photo.monument >> c.x() >> c.y() >> c.z() >> q.w() >> q.x() >> q.y() >> q.z() &&
          photo.monument >= 0;
      truth.photos.push_back(photo);
    }
    if (!valid) {
      throw std::runtime_error(path + ": cannot understand line " + std::to_string(line_number));
    }
  }
  if (!has_camera || truth.photos.empty()) {
    throw std::runtime_error(path + ": no camera line or no photos");
  }
  return truth;
}

}  // namespace colmap_graphmatch::synthetic
