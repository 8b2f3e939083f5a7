// The cameras that took the photos, and the file that records them.

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

namespace colmap_graphmatch::synthetic {

// COLMAP's PINHOLE model: the middle of the upper left pixel is (0.5, 0.5).
struct Intrinsics {
  int width = 800;
  int height = 600;
  double fx = 740.0;
  double fy = 740.0;
  double cx = 400.0;
  double cy = 300.0;
};

// A photo and its pose; x is right, y down, z forward in the frame of the camera.
struct Photo {
  std::string name;
  int monument = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Quaterniond world_to_camera = Eigen::Quaterniond::Identity();
};

struct Truth {
  Intrinsics intrinsics;
  std::vector<Photo> photos;
};

// Photos such as somebody takes who walks round a part of each monument. Names are numbered in an
// order that says nothing about monuments, and `photos` is sorted by name.
Truth PlanPhotos(uint32_t seed);

// Tab-separated: the line '# PINHOLE <fx,fy,cx,cy> <width> <height>', a line of column names, one
// line a photo. Both throw std::runtime_error with the path if the file is no good.
void WriteTruth(const std::string& path, const Truth& truth);
Truth ReadTruth(const std::string& path);

}  // namespace colmap_graphmatch::synthetic
