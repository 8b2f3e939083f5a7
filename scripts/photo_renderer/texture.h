// Procedural stone textures that never repeat: each stone, stain and painted dot is hashed from its
// place on the surface.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace colmap_graphmatch::synthetic {

enum class Masonry {
  kCoursed,  // Rows of rectangular stones.
  kRubble,   // Irregular stones.
};

struct Material {
  Masonry masonry = Masonry::kCoursed;
  Eigen::Vector2f stone_size = Eigen::Vector2f(0.6f, 0.3f);
  // Colours of stones, and of what is painted on them; components in [0, 1].
  std::array<Eigen::Vector3f, 4> stone_colors;
  std::array<Eigen::Vector3f, 4> paint_colors;
  // Fraction of the stones that carry an emblem, and of the dot grid that is painted.
  float emblem_density = 0.2f;
  float dot_density = 0.3f;
  float noise_contrast = 0.65f;
};

struct SurfacePoint {
  Eigen::Vector3f position;
  Eigen::Vector3f normal;
  // Lengths along the surface, in world units.
  Eigen::Vector2f uv;
  // Differs between all faces of all scenes.
  uint32_t face_id = 0;
};

// Colour without lighting. Detail finer than `footprint` (the size of a pixel on the surface) is
// left out, since it would only alias.
Eigen::Vector3f SurfaceColor(const Material& material, const SurfacePoint& point, uint32_t seed,
                             float footprint);

}  // namespace colmap_graphmatch::synthetic
