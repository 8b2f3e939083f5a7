// Solids, and the colour of what a ray through them sees.

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "scripts/photo_renderer/texture.h"

namespace colmap_graphmatch::synthetic {

enum class Shape {
  kTaperedBox,  // A box whose top may be smaller than its bottom: also pyramids and gable roofs.
  kFrustum,     // Round, upright: also cylinders, cones and discs.
  kDome,        // The upper half of a ball.
};

struct Solid {
  Shape shape = Shape::kTaperedBox;
  // The middle of the bottom.
  Eigen::Vector3f base = Eigen::Vector3f::Zero();
  float height = 0.0f;
  // Half extents of a box; the radius of round shapes is the x component.
  Eigen::Vector2f bottom = Eigen::Vector2f::Zero();
  Eigen::Vector2f top = Eigen::Vector2f::Zero();
  float cos_yaw = 1.0f;
  float sin_yaw = 0.0f;
  uint32_t material = 0;
  // Bounding sphere.
  Eigen::Vector3f bound_center = Eigen::Vector3f::Zero();
  float bound_radius = 0.0f;
};

struct Ray {
  Eigen::Vector3f origin;
  Eigen::Vector3f direction;  // Of unit length.
};

class Scene {
 public:
  explicit Scene(uint32_t seed) : seed_(seed) {}

  // The functions that add things return an index or nothing; z is upwards, the ground at 0.
  uint32_t AddMaterial(const Material& material);
  void AddTaperedBox(uint32_t material, const Eigen::Vector3f& base, const Eigen::Vector2f& bottom,
                     const Eigen::Vector2f& top, float height, float yaw);
  void AddFrustum(uint32_t material, const Eigen::Vector3f& base, float bottom_radius,
                  float top_radius, float height);
  void AddDome(uint32_t material, const Eigen::Vector3f& base, float radius);
  void SetLight(const Eigen::Vector3f& sun_direction, const Eigen::Vector3f& sky_color,
                const Eigen::Vector3f& lawn_color);

  // Indices of the solids that rays within the cone may hit.
  std::vector<uint32_t> SolidsInCone(const Ray& axis, float half_angle) const;

  // What the ray sees of the solids given. A pixel covers `pixel_angle` radians.
  Eigen::Vector3f Trace(const Ray& ray, const std::vector<uint32_t>& solids,
                        float pixel_angle) const;

 private:
  void AddSolid(Solid solid);
  bool InShadow(const Eigen::Vector3f& position) const;
  Eigen::Vector3f Background(const Eigen::Vector3f& direction) const;

  uint32_t seed_;
  std::vector<Material> materials_;
  std::vector<Solid> solids_;
  Eigen::Vector3f sun_direction_ = Eigen::Vector3f::UnitZ();
  Eigen::Vector3f sky_color_ = Eigen::Vector3f::Ones();
  Eigen::Vector3f lawn_color_ = Eigen::Vector3f::Ones();
};

}  // namespace colmap_graphmatch::synthetic
