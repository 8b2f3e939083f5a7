#include "scripts/photo_renderer/texture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scripts/photo_renderer/hashing.h"

namespace colmap_graphmatch::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

struct Stone {
  uint32_t hash = 0;
  // Offset from the stone's middle, and the distance to its border.
  Vector2f local = Vector2f::Zero();
  float edge_distance = 0.0f;
};

uint32_t HashCell(uint32_t seed, int x, int y) {
  return Mix(seed ^ (static_cast<uint32_t>(x) * 73856093u) ^
             (static_cast<uint32_t>(y) * 19349663u));
}

float Smooth(float t) { return t * t * (3.0f - 2.0f * t); }

// Trilinear interpolation of random values on the integer lattice; in [0, 1).
float ValueNoise(const Vector3f& p, uint32_t seed) {
  const float fx = std::floor(p.x());
  const float fy = std::floor(p.y());
  const float fz = std::floor(p.z());
  const uint32_t x = static_cast<uint32_t>(static_cast<int>(fx)) * 73856093u;
  const uint32_t y = static_cast<uint32_t>(static_cast<int>(fy)) * 19349663u;
  const uint32_t z = static_cast<uint32_t>(static_cast<int>(fz)) * 83492791u;
  const uint32_t x1 = x + 73856093u;
  const uint32_t y1 = y + 19349663u;
  const uint32_t z1 = z + 83492791u;
  const float tx = Smooth(p.x() - fx);
  const float ty = Smooth(p.y() - fy);
  const float tz = Smooth(p.z() - fz);
  const auto along_x = [&](uint32_t yz) {
    const float a = Uniform(Mix(seed ^ x ^ yz));
    return a + tx * (Uniform(Mix(seed ^ x1 ^ yz)) - a);
  };
  const float near_z = along_x(y ^ z) + ty * (along_x(y1 ^ z) - along_x(y ^ z));
  const float far_z = along_x(y ^ z1) + ty * (along_x(y1 ^ z1) - along_x(y ^ z1));
  return near_z + tz * (far_z - near_z);
}

// Sum of octaves, about zero on average. All but the coarsest, which would only blacken whole
// walls, are of equal strength: features are wanted at all scales.
float FractalNoise(const Vector3f& position, uint32_t seed, float footprint) {
  constexpr float kCoarsest = 1.1f;
  constexpr int kNumOctaves = 6;
  float sum = 0.0f;
  float wavelength = kCoarsest;
  for (int i = 0; i < kNumOctaves; ++i, wavelength *= 0.53f) {
    const float resolved = std::clamp(0.5f * wavelength / footprint - 0.5f, 0.0f, 1.0f);
    if (resolved <= 0.0f) break;
    const float weight = i == 0 ? 0.5f * resolved : resolved;
    const uint32_t octave_seed = Hash(seed, static_cast<uint32_t>(i));
    sum += weight * (ValueNoise(position / wavelength, octave_seed) - 0.5f);
  }
  return sum;
}

Stone CoursedStone(const Vector2f& uv, const Vector2f& size, uint32_t seed) {
  const int row = static_cast<int>(std::floor(uv.y() / size.y()));
  const uint32_t row_hash = HashCell(seed, 0, row);
  const float width = size.x() * Uniform(row_hash, 0.6f, 1.5f);
  const float u = uv.x() + 10.0f * width * Uniform(Mix(row_hash));
  const int column = static_cast<int>(std::floor(u / width));
  Stone stone;
  stone.hash = HashCell(Mix(seed), column, row);
  stone.local = Vector2f(u - (static_cast<float>(column) + 0.5f) * width,
                         uv.y() - (static_cast<float>(row) + 0.5f) * size.y());
  stone.edge_distance = std::min(0.5f * width - std::abs(stone.local.x()),
                                 0.5f * size.y() - std::abs(stone.local.y()));
  return stone;
}

// Voronoi cells of a jittered grid.
Stone RubbleStone(const Vector2f& uv, const Vector2f& size, uint32_t seed) {
  const int column = static_cast<int>(std::floor(uv.x() / size.x()));
  const int row = static_cast<int>(std::floor(uv.y() / size.y()));
  Stone stone;
  float nearest = std::numeric_limits<float>::max();
  float second = nearest;
  for (int y = row - 1; y <= row + 1; ++y) {
    for (int x = column - 1; x <= column + 1; ++x) {
      const uint32_t hash = HashCell(seed, x, y);
      const Vector2f site((static_cast<float>(x) + Uniform(hash, 0.1f, 0.9f)) * size.x(),
                          (static_cast<float>(y) + Uniform(Mix(hash + 1), 0.1f, 0.9f)) * size.y());
      const float distance = (uv - site).norm();
      if (distance < nearest) {
        second = nearest;
        nearest = distance;
        stone.hash = hash;
        stone.local = uv - site;
      } else if (distance < second) {
        second = distance;
      }
    }
  }
  stone.edge_distance = 0.5f * (second - nearest);
  return stone;
}

const Vector3f& Pick(const std::array<Vector3f, 4>& colors, uint32_t hash) {
  return colors[(hash >> 16) % colors.size()];
}

// A few discs of paint over each other in the middle of a stone.
void PaintEmblem(const Material& material, const Stone& stone, Vector3f* color) {
  HashSequence random(Mix(stone.hash + 7));
  const float scale = std::min(material.stone_size.x(), material.stone_size.y());
  for (int i = 0; i < 3; ++i) {
    const Vector2f center(random.Uniform(-0.25f, 0.25f), random.Uniform(-0.25f, 0.25f));
    const float radius = scale * random.Uniform(0.1f, 0.3f);
    const uint32_t pick = random.Next();
    if ((stone.local - scale * center).squaredNorm() < radius * radius) {
      *color = Pick(material.paint_colors, pick);
    }
  }
}

// Dots of random size and place, at most one in each cell of a grid.
void PaintDots(const Material& material, const Vector2f& uv, float cell, uint32_t seed,
               Vector3f* color) {
  const int x = static_cast<int>(std::floor(uv.x() / cell));
  const int y = static_cast<int>(std::floor(uv.y() / cell));
  const uint32_t hash = HashCell(seed, x, y);
  if (Uniform(hash) >= material.dot_density) return;
  HashSequence random(hash);
  const float radius = random.Uniform(0.1f, 0.35f);
  const Vector2f center(random.Uniform(radius, 1.0f - radius),
                        random.Uniform(radius, 1.0f - radius));
  const Vector2f offset = uv / cell - Vector2f(static_cast<float>(x), static_cast<float>(y));
  // Squashed discs, so that dots differ in shape as well.
  const float squash = random.Uniform(1.0f, 2.0f);
  const Vector2f delta = offset - center;
  if (delta.x() * delta.x() + squash * delta.y() * delta.y() < radius * radius) {
    *color = 0.35f * *color + 0.65f * Pick(material.paint_colors, random.Next());
  }
}

}  // namespace

Vector3f SurfaceColor(const Material& material, const SurfacePoint& point, uint32_t seed,
                      float footprint) {
  const uint32_t face_seed = Hash(seed, point.face_id);
  const float noise = FractalNoise(point.position, seed, footprint);

  // Joints that waver a little look hewn rather than drawn.
  const Vector2f uv = point.uv + 0.03f * Vector2f(noise, -noise);
  const Stone stone = material.masonry == Masonry::kCoursed
                          ? CoursedStone(uv, material.stone_size, face_seed)
                          : RubbleStone(uv, material.stone_size, face_seed);
  Vector3f color = Pick(material.stone_colors, stone.hash) * Uniform(Mix(stone.hash), 0.65f, 1.2f);
  if (Uniform(Mix(stone.hash + 1)) < material.emblem_density) {
    PaintEmblem(material, stone, &color);
  }
  PaintDots(material, point.uv, 0.55f, Mix(face_seed + 1), &color);
  PaintDots(material, point.uv, 0.23f, Mix(face_seed + 2), &color);

  const float joint = std::clamp(stone.edge_distance / 0.025f, 0.35f, 1.0f);
  return color * (joint * std::max(0.25f, 1.0f + material.noise_contrast * noise));
}

}  // namespace colmap_graphmatch::synthetic
