// Renders photos of three monuments, and writes down the cameras that took them.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <boost/program_options.hpp>
#include <cmath>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <future>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "scripts/photo_renderer/cameras.h"
#include "scripts/photo_renderer/jpeg_writer.h"
#include "scripts/photo_renderer/monuments.h"
#include "scripts/photo_renderer/scene.h"

namespace colmap_graphmatch::synthetic {
namespace {

constexpr int kJpegQuality = 92;
// Solids are culled once for each square of so many pixels.
constexpr int kTileSize = 20;
// Each pixel averages kSubSamples * kSubSamples rays.
constexpr int kSubSamples = 2;

std::vector<uint8_t> RenderPhoto(const Scene& scene, const Intrinsics& k, const Photo& photo) {
  const Eigen::Matrix3d camera_to_world = photo.world_to_camera.conjugate().toRotationMatrix();
  const auto ray_at = [&](double x, double y) {
    const Eigen::Vector3d in_camera((x - k.cx) / k.fx, (y - k.cy) / k.fy, 1.0);
    return Ray{photo.center.cast<float>(),
               (camera_to_world * in_camera.normalized()).cast<float>()};
  };
  const float pixel_angle = static_cast<float>(1.0 / k.fx);
  // Pixels subtend most in the middle of the photo, so this bounds every tile.
  const float tile_half_angle = pixel_angle * static_cast<float>(kTileSize) * 0.75f;

  std::vector<uint8_t> rgb(3 * static_cast<size_t>(k.width) * static_cast<size_t>(k.height));
  for (int tile_y = 0; tile_y < k.height; tile_y += kTileSize) {
    for (int tile_x = 0; tile_x < k.width; tile_x += kTileSize) {
      const std::vector<uint32_t> solids = scene.SolidsInCone(
          ray_at(tile_x + 0.5 * kTileSize, tile_y + 0.5 * kTileSize), tile_half_angle);
      for (int y = tile_y; y < std::min(tile_y + kTileSize, k.height); ++y) {
        for (int x = tile_x; x < std::min(tile_x + kTileSize, k.width); ++x) {
          Eigen::Vector3f color = Eigen::Vector3f::Zero();
          for (int s = 0; s < kSubSamples * kSubSamples; ++s) {
            const double sub_x = (s % kSubSamples + 0.5) / kSubSamples;
            const double sub_y = (s / kSubSamples + 0.5) / kSubSamples;
            color += scene.Trace(ray_at(x + sub_x, y + sub_y), solids, pixel_angle).cwiseMin(1.0f);
          }
          color *= 255.0f / (kSubSamples * kSubSamples);
          uint8_t* pixel = &rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(k.width) +
                                     static_cast<size_t>(x))];
          for (int c = 0; c < 3; ++c) pixel[c] = static_cast<uint8_t>(std::lround(color[c]));
        }
      }
    }
  }
  return rgb;
}

void RenderAll(const Truth& truth, const std::filesystem::path& directory, uint32_t seed,
               int num_threads) {
  std::vector<Scene> scenes;
  for (const Photo& photo : truth.photos) {
    while (static_cast<int>(scenes.size()) <= photo.monument) {
      scenes.push_back(BuildMonument(static_cast<int>(scenes.size()), seed));
    }
  }
  std::atomic<size_t> next{0};
  const auto work = [&] {
    for (size_t i = next++; i < truth.photos.size(); i = next++) {
      const Photo& photo = truth.photos[i];
      const Intrinsics& k = truth.intrinsics;
      const std::vector<uint8_t> rgb =
          RenderPhoto(scenes[static_cast<size_t>(photo.monument)], k, photo);
      try {
        WriteJpeg((directory / photo.name).string(), k.width, k.height, kJpegQuality, rgb);
      } catch (...) {
        // What fails for one photo will fail for others: let all workers stop.
        next = truth.photos.size();
        throw;
      }
    }
  };
  std::vector<std::future<void>> workers;
  for (int i = 0; i < num_threads; ++i) workers.push_back(std::async(std::launch::async, work));
  for (std::future<void>& worker : workers) worker.get();
}

int Run(int argc, char** argv) {
  namespace po = boost::program_options;
  std::string output_path;
  std::string truth_path;
  uint32_t seed = 0;
  int num_threads = -1;
  po::options_description options("Renders photos of three monuments from known cameras");
  options.add_options()("help", "show this help")(
      "output_path", po::value(&output_path)->required(), "directory for the photos")(
      "truth_path", po::value(&truth_path),
      "file for the cameras (default: cameras.tsv beside output_path)")(
      "seed", po::value(&seed)->default_value(seed), "other seeds give other monuments")(
      "num_threads", po::value(&num_threads)->default_value(num_threads),
      "-1 for all of the machine's");
  po::variables_map variables;
  po::store(po::parse_command_line(argc, argv, options), variables);
  if (variables.count("help") > 0) {
    std::cout << options;
    return 0;
  }
  po::notify(variables);

  // An absolute path without trailing slash has the wanted parent whatever was typed.
  std::filesystem::path directory = std::filesystem::absolute(output_path).lexically_normal();
  if (!directory.has_filename()) directory = directory.parent_path();
  if (truth_path.empty()) truth_path = (directory.parent_path() / "cameras.tsv").string();
  if (num_threads <= 0) num_threads = static_cast<int>(std::thread::hardware_concurrency());

  std::filesystem::create_directories(directory);
  const Truth truth = PlanPhotos(seed);
  WriteTruth(truth_path, truth);
  RenderAll(truth, directory, seed, std::max(1, num_threads));
  std::cout << "Rendered " << truth.photos.size() << " photos to " << directory.string()
            << ", their cameras to " << truth_path << std::endl;
  return 0;
}

}  // namespace
}  // namespace colmap_graphmatch::synthetic

int main(int argc, char** argv) {
  try {
    return colmap_graphmatch::synthetic::Run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "render_photos: " << error.what() << std::endl;
    return 1;
  }
}
