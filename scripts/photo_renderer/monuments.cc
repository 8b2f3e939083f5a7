#include "scripts/photo_renderer/monuments.h"

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "scripts/photo_renderer/hashing.h"

namespace colmap_graphmatch::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kTwoPi = 6.2831853f;
constexpr float kGroundRadius = 11.0f;

Vector3f Polar(float radius, float angle, float z) {
  return Vector3f(radius * std::cos(angle), radius * std::sin(angle), z);
}

// Four colours as 0xRRGGBB.
using Palette = std::array<uint32_t, 4>;

std::array<Vector3f, 4> ToColors(const Palette& palette) {
  std::array<Vector3f, 4> colors;
  for (size_t i = 0; i < palette.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      colors[i][c] = static_cast<float>((palette[i] >> (16 - 8 * c)) & 0xFF) / 255.0f;
    }
  }
  return colors;
}

uint32_t AddMaterial(Masonry masonry, const Vector2f& stone_size, const Palette& stone_colors,
                     const Palette& paint_colors, Scene* scene) {
  Material material;
  material.masonry = masonry;
  material.stone_size = stone_size;
  material.stone_colors = ToColors(stone_colors);
  material.paint_colors = ToColors(paint_colors);
  return scene->AddMaterial(material);
}

// Its top is the plane z = 0.
void AddGround(uint32_t material, Scene* scene) {
  scene->AddFrustum(material, Vector3f(0.0f, 0.0f, -0.2f), kGroundRadius, kGroundRadius, 0.2f);
}

void AddBox(uint32_t material, const Vector3f& base, float half_x, float half_y, float height,
            float yaw, Scene* scene) {
  const Vector2f extent(half_x, half_y);
  scene->AddTaperedBox(material, base, extent, extent, height, yaw);
}

// Low blocks strewn about, which break the symmetry and give depth to the foreground.
void AddScatteredBlocks(uint32_t material, int num_blocks, HashSequence* random, Scene* scene) {
  for (int i = 0; i < num_blocks; ++i) {
    const float angle = kTwoPi * (static_cast<float>(i) + random->Uniform(0.0f, 0.7f)) /
                        static_cast<float>(num_blocks);
    const Vector3f base = Polar(random->Uniform(7.5f, 9.5f), angle, 0.0f);
    const float size = random->Uniform(0.25f, 0.5f);
    const float height = random->Uniform(0.4f, 1.1f);
    scene->AddTaperedBox(material, base, Vector2f(size, 0.8f * size),
                         Vector2f(0.8f * size, 0.6f * size), height, random->Uniform(0.0f, 6.0f));
  }
}

// A round domed temple with a ring of columns and a gabled porch; pale marble, painted.
Scene BuildTemple(uint32_t seed) {
  Scene scene(seed);
  HashSequence random(seed);
  const Palette paint = {0x264099, 0xB23326, 0x261F1A, 0xE6BF40};
  const Palette marble = {0xD9CCB2, 0xBFAD94, 0xE6E0D1, 0xA6998C};
  const Palette copper = {0x599985, 0x47807A, 0x73AD94, 0x667359};
  const Palette paving = {0x998066, 0x807361, 0xB2997A, 0x736152};
  const uint32_t wall = AddMaterial(Masonry::kCoursed, {0.7f, 0.36f}, marble, paint, &scene);
  const uint32_t roof = AddMaterial(Masonry::kCoursed, {0.4f, 0.4f}, copper, paint, &scene);
  const uint32_t ground = AddMaterial(Masonry::kRubble, {0.8f, 0.6f}, paving, paint, &scene);

  AddGround(ground, &scene);
  for (int i = 0; i < 3; ++i) {
    const float step = static_cast<float>(i);
    const float radius = 6.0f - 0.45f * step;
    scene.AddFrustum(wall, Vector3f(0.0f, 0.0f, 0.28f * step), radius, radius, 0.28f);
  }
  const float floor = 0.84f;
  scene.AddFrustum(wall, Vector3f(0.0f, 0.0f, floor), 3.4f, 3.4f, 3.3f);
  constexpr int kNumColumns = 12;
  for (int i = 0; i < kNumColumns; ++i) {
    const float angle = kTwoPi * static_cast<float>(i) / kNumColumns;
    scene.AddFrustum(wall, Polar(4.5f, angle, floor), 0.36f, 0.3f, 3.3f);
  }
  scene.AddFrustum(wall, Vector3f(0.0f, 0.0f, floor + 3.3f), 4.95f, 5.1f, 0.6f);
  scene.AddFrustum(wall, Vector3f(0.0f, 0.0f, floor + 3.9f), 3.7f, 3.6f, 0.8f);
  scene.AddDome(roof, Vector3f(0.0f, 0.0f, floor + 4.7f), 3.4f);
  scene.AddFrustum(wall, Vector3f(0.0f, 0.0f, floor + 7.9f), 0.55f, 0.5f, 0.7f);
  scene.AddFrustum(roof, Vector3f(0.0f, 0.0f, floor + 8.6f), 0.65f, 0.0f, 0.8f);

  const float front = random.Uniform(-0.3f, 0.3f);
  const Vector3f side = Polar(1.0f, front + 0.25f * kTwoPi, 0.0f);
  AddBox(wall, Polar(5.6f, front, 0.0f), 1.6f, 2.4f, floor, front, &scene);
  for (const float offset : {-2.0f, -0.75f, 0.75f, 2.0f}) {
    scene.AddFrustum(wall, Polar(6.7f, front, floor) + offset * side, 0.28f, 0.24f, 2.7f);
  }
  AddBox(wall, Polar(5.8f, front, floor + 2.7f), 1.4f, 2.5f, 0.4f, front, &scene);
  scene.AddTaperedBox(roof, Polar(5.8f, front, floor + 3.1f), Vector2f(1.4f, 2.5f),
                      Vector2f(1.4f, 0.0f), 1.1f, front);
  AddScatteredBlocks(wall, 9, &random, &scene);
  scene.SetLight(Polar(1.0f, random.Uniform(-0.9f, 0.9f), 1.1f), {0.4f, 0.58f, 0.85f},
                 {0.42f, 0.5f, 0.3f});
  return scene;
}

// Square terraces turned against each other, with an obelisk on top; red brick.
Scene BuildSteppedTower(uint32_t seed) {
  Scene scene(seed);
  HashSequence random(seed);
  const Palette paint = {0xE6D9B2, 0x1A6666, 0x332640, 0xF2991A};
  const Palette brick = {0xB25C40, 0x944C38, 0xCC8052, 0x804742};
  const Palette granite = {0xBF8C80, 0x99807A, 0xD9AD99, 0x806B6B};
  const Palette sand = {0xCCAD73, 0xB29466, 0x998059, 0xD9BF8C};
  const uint32_t terrace = AddMaterial(Masonry::kCoursed, {0.42f, 0.2f}, brick, paint, &scene);
  const uint32_t shaft = AddMaterial(Masonry::kCoursed, {0.5f, 0.5f}, granite, paint, &scene);
  const uint32_t ground = AddMaterial(Masonry::kCoursed, {0.7f, 0.5f}, sand, paint, &scene);

  AddGround(ground, &scene);
  const float yaw = random.Uniform(-0.3f, 0.3f);
  const float half_widths[] = {4.6f, 3.6f, 2.7f, 1.9f};
  float z = 0.0f;
  float turn = yaw;
  for (const float half : half_widths) {
    scene.AddTaperedBox(terrace, Vector3f(0.0f, 0.0f, z), Vector2f(half, half),
                        Vector2f(half - 0.25f, half - 0.25f), 1.15f, turn);
    z += 1.15f;
    turn += 0.17f;
  }
  scene.AddTaperedBox(shaft, Vector3f(0.0f, 0.0f, z), Vector2f(1.05f, 1.05f), Vector2f(0.6f, 0.6f),
                      4.0f, turn);
  scene.AddTaperedBox(shaft, Vector3f(0.0f, 0.0f, z + 4.0f), Vector2f(0.75f, 0.75f),
                      Vector2f(0.0f, 0.0f), 0.9f, turn);
  // A flight of stairs up the first terraces, on two of the sides.
  for (const float direction : {yaw, yaw + 0.5f * kTwoPi}) {
    for (int i = 0; i < 5; ++i) {
      const float step = static_cast<float>(i);
      AddBox(shaft, Polar(4.3f, direction, 0.0f), 1.7f - 0.3f * step, 0.9f, 0.25f * (step + 1.0f),
             direction, &scene);
    }
  }
  // Guardian pillars of unequal height at the corners.
  for (int i = 0; i < 4; ++i) {
    const float angle = yaw + kTwoPi * (0.125f + 0.25f * static_cast<float>(i));
    const float height = random.Uniform(1.6f, 3.4f);
    const Vector3f base = Polar(7.0f, angle, 0.0f);
    scene.AddFrustum(shaft, base, 0.5f, 0.4f, height);
    scene.AddDome(terrace, base + Vector3f(0.0f, 0.0f, height), 0.5f);
  }
  AddScatteredBlocks(shaft, 7, &random, &scene);
  scene.SetLight(Polar(1.0f, random.Uniform(-0.9f, 0.9f), 0.9f), {0.6f, 0.7f, 0.8f},
                 {0.62f, 0.55f, 0.38f});
  return scene;
}

void AddMerlons(uint32_t material, const Vector3f& from, const Vector3f& to, int count, float yaw,
                Scene* scene) {
  for (int i = 0; i < count; ++i) {
    const float t = (static_cast<float>(i) + 0.5f) / static_cast<float>(count);
    AddBox(material, from + t * (to - from), 0.22f, 0.22f, 0.5f, yaw, scene);
  }
}

// Two unequal round towers with a gateway between, curtain walls and a keep; grey field stones.
Scene BuildGatehouse(uint32_t seed) {
  Scene scene(seed);
  HashSequence random(seed);
  const Palette paint = {0xCCCCBF, 0x597340, 0x1F1F26, 0x996633};
  const Palette field_stone = {0x8C8C8C, 0x73706B, 0xADA899, 0x807866};
  const Palette slate = {0x4C526B, 0x616173, 0x404052, 0x7A6B6B};
  const Palette grass = {0x597338, 0x738047, 0x80734C, 0x4C6133};
  const uint32_t wall = AddMaterial(Masonry::kRubble, {0.5f, 0.36f}, field_stone, paint, &scene);
  const uint32_t roof = AddMaterial(Masonry::kCoursed, {0.3f, 0.22f}, slate, paint, &scene);
  const uint32_t ground = AddMaterial(Masonry::kRubble, {0.6f, 0.6f}, grass, paint, &scene);

  AddGround(ground, &scene);
  const float yaw = random.Uniform(-0.3f, 0.3f) - 0.25f * kTwoPi;
  // A frame with x along the wall and y out of the gate.
  const auto place = [&](float x, float y, float z) {
    return Vector3f(std::cos(yaw) * x - std::sin(yaw) * y, std::sin(yaw) * x + std::cos(yaw) * y,
                    z);
  };
  for (const float x : {-1.25f, 1.25f}) {
    AddBox(wall, place(x, 0.9f, 0.0f), 0.35f, 1.2f, 2.6f, yaw, &scene);
  }
  AddBox(wall, place(0.0f, 0.9f, 2.6f), 1.6f, 1.2f, 1.8f, yaw, &scene);
  AddMerlons(wall, place(-1.5f, 1.85f, 4.4f), place(1.5f, 1.85f, 4.4f), 4, yaw, &scene);

  scene.AddFrustum(wall, place(-2.8f, 0.9f, 0.0f), 1.65f, 1.45f, 5.4f);
  scene.AddFrustum(roof, place(-2.8f, 0.9f, 5.4f), 1.8f, 0.0f, 2.6f);
  scene.AddFrustum(wall, place(2.8f, 0.9f, 0.0f), 1.75f, 1.6f, 4.7f);
  scene.AddFrustum(wall, place(2.8f, 0.9f, 4.7f), 1.85f, 1.85f, 0.5f);
  for (int i = 0; i < 9; ++i) {
    const float angle = kTwoPi * static_cast<float>(i) / 9.0f;
    AddBox(wall, place(2.8f, 0.9f, 5.2f) + Polar(1.6f, angle, 0.0f), 0.22f, 0.3f, 0.55f, angle,
           &scene);
  }

  AddBox(wall, place(-5.2f, 0.6f, 0.0f), 1.3f, 0.5f, 2.9f, yaw + 0.12f, &scene);
  AddMerlons(wall, place(-6.3f, 0.6f, 2.9f), place(-4.2f, 0.6f, 2.9f), 3, yaw, &scene);
  AddBox(wall, place(5.3f, 0.5f, 0.0f), 1.3f, 0.5f, 2.4f, yaw - 0.15f, &scene);
  AddMerlons(wall, place(4.5f, 0.6f, 2.4f), place(6.4f, 0.4f, 2.4f), 3, yaw, &scene);

  AddBox(wall, place(0.4f, -3.0f, 0.0f), 2.3f, 1.9f, 5.6f, yaw + 0.1f, &scene);
  scene.AddTaperedBox(roof, place(0.4f, -3.0f, 5.6f), Vector2f(2.6f, 2.2f), Vector2f(1.2f, 0.0f),
                      2.2f, yaw + 0.1f);
  AddBox(wall, place(1.7f, -3.6f, 5.6f), 0.35f, 0.35f, 2.6f, yaw + 0.1f, &scene);
  AddBox(wall, place(-3.4f, -3.4f, 0.0f), 1.4f, 1.1f, 1.9f, yaw - 0.2f, &scene);
  scene.AddTaperedBox(roof, place(-3.4f, -3.4f, 1.9f), Vector2f(1.6f, 1.3f), Vector2f(1.6f, 0.0f),
                      1.2f, yaw - 0.2f);
  AddScatteredBlocks(wall, 8, &random, &scene);
  scene.SetLight(Polar(1.0f, random.Uniform(-0.9f, 0.9f), 1.3f), {0.5f, 0.55f, 0.68f},
                 {0.33f, 0.43f, 0.22f});
  return scene;
}

}  // namespace

Scene BuildMonument(int index, uint32_t seed) {
  const uint32_t monument_seed = Hash(seed, static_cast<uint32_t>(index) + 1);
  switch (index) {
    case 0:
      return BuildTemple(monument_seed);
    case 1:
      return BuildSteppedTower(monument_seed);
    case 2:
      return BuildGatehouse(monument_seed);
    default:
      throw std::invalid_argument("there is no monument " + std::to_string(index));
  }
}

}  // namespace colmap_graphmatch::synthetic
