#include "scripts/photo_renderer/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "scripts/photo_renderer/hashing.h"

namespace colmap_graphmatch::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// Rays that leave a surface must not hit it again at once.
constexpr float kMinDistance = 1e-3f;

struct Hit {
  float distance = std::numeric_limits<float>::max();
  Vector3f normal = Vector3f::Zero();
  Vector2f uv = Vector2f::Zero();
  uint32_t face = 0;
};

bool IntersectTaperedBox(const Solid& solid, const Ray& ray, Hit* hit) {
  // In the frame of the box every face is a plane with a simple equation.
  const auto to_box = [&](const Vector3f& v) {
    return Vector3f(solid.cos_yaw * v.x() + solid.sin_yaw * v.y(),
                    solid.cos_yaw * v.y() - solid.sin_yaw * v.x(), v.z());
  };
  const Vector3f origin = to_box(ray.origin - solid.base);
  const Vector3f direction = to_box(ray.direction);
  const float slope_x = (solid.bottom.x() - solid.top.x()) / solid.height;
  const float slope_y = (solid.bottom.y() - solid.top.y()) / solid.height;
  const Vector3f normals[6] = {{1.0f, 0.0f, slope_x}, {-1.0f, 0.0f, slope_x},
                               {0.0f, 1.0f, slope_y}, {0.0f, -1.0f, slope_y},
                               {0.0f, 0.0f, 1.0f},    {0.0f, 0.0f, -1.0f}};
  const float offsets[6] = {solid.bottom.x(), solid.bottom.x(), solid.bottom.y(),
                            solid.bottom.y(), solid.height,     0.0f};
  float enter = kMinDistance;
  float leave = hit->distance;
  int face = -1;
  for (int i = 0; i < 6; ++i) {
    const float height_above = normals[i].dot(origin) - offsets[i];
    const float speed = normals[i].dot(direction);
    if (speed == 0.0f) {
      if (height_above > 0.0f) return false;
      continue;
    }
    const float t = -height_above / speed;
    if (speed > 0.0f) {
      leave = std::min(leave, t);
    } else if (t > enter) {
      enter = t;
      face = i;
    }
    if (enter >= leave) return false;
  }
  if (face < 0) return false;

  const Vector3f p = origin + enter * direction;
  const Vector3f normal = normals[face].normalized();
  hit->distance = enter;
  hit->face = static_cast<uint32_t>(face);
  hit->normal = Vector3f(solid.cos_yaw * normal.x() - solid.sin_yaw * normal.y(),
                         solid.sin_yaw * normal.x() + solid.cos_yaw * normal.y(), normal.z());
  // On slanted sides, lengths along the slope.
  const float up = p.z() * normals[face].norm();
  hit->uv = face < 2 ? Vector2f(p.y(), up) : face < 4 ? Vector2f(p.x(), up) : p.head<2>().eval();
  return true;
}

bool IntersectFrustum(const Solid& solid, const Ray& ray, Hit* hit) {
  const Vector3f origin = ray.origin - solid.base;
  const Vector3f& direction = ray.direction;
  bool found = false;

  const float growth = (solid.top.x() - solid.bottom.x()) / solid.height;
  const float radius_at_origin = solid.bottom.x() + growth * origin.z();
  const float radius_speed = growth * direction.z();
  const float a = direction.head<2>().squaredNorm() - radius_speed * radius_speed;
  const float b = origin.head<2>().dot(direction.head<2>()) - radius_at_origin * radius_speed;
  const float c = origin.head<2>().squaredNorm() - radius_at_origin * radius_at_origin;
  const float discriminant = b * b - a * c;
  if (discriminant > 0.0f && a != 0.0f) {
    const float root = std::sqrt(discriminant);
    for (const float t : {(-b - root) / a, (-b + root) / a}) {
      if (t < kMinDistance || t >= hit->distance) continue;
      const Vector3f p = origin + t * direction;
      // Beyond the apex lies the mirror image of the cone.
      const float radius = solid.bottom.x() + growth * p.z();
      if (p.z() < 0.0f || p.z() > solid.height || radius <= 0.0f) continue;
      hit->distance = t;
      hit->normal = Vector3f(p.x() / radius, p.y() / radius, -growth).normalized();
      const float mean_radius = 0.5f * (solid.bottom.x() + solid.top.x());
      hit->uv = Vector2f(mean_radius * std::atan2(p.y(), p.x()),
                         p.z() * std::sqrt(1.0f + growth * growth));
      hit->face = 0;
      found = true;
    }
  }

  for (const uint32_t face : {1u, 2u}) {
    const float z = face == 1 ? solid.height : 0.0f;
    const float radius = face == 1 ? solid.top.x() : solid.bottom.x();
    const float t = (z - origin.z()) / direction.z();
    if (!(t > kMinDistance && t < hit->distance)) continue;
    const Vector2f p = origin.head<2>() + t * direction.head<2>();
    if (p.squaredNorm() > radius * radius) continue;
    hit->distance = t;
    hit->normal = Vector3f(0.0f, 0.0f, face == 1 ? 1.0f : -1.0f);
    hit->uv = p;
    hit->face = face;
    found = true;
  }
  return found;
}

bool IntersectDome(const Solid& solid, const Ray& ray, Hit* hit) {
  const Vector3f origin = ray.origin - solid.base;
  const float radius = solid.bottom.x();
  const float b = origin.dot(ray.direction);
  const float discriminant = b * b - origin.squaredNorm() + radius * radius;
  if (discriminant <= 0.0f) return false;
  const float t = -b - std::sqrt(discriminant);
  if (t < kMinDistance || t >= hit->distance) return false;
  const Vector3f p = origin + t * ray.direction;
  if (p.z() < 0.0f) return false;
  hit->distance = t;
  hit->normal = p / radius;
  hit->uv = radius * Vector2f(std::atan2(p.y(), p.x()), std::asin(std::min(1.0f, p.z() / radius)));
  hit->face = 0;
  return true;
}

// Whether the solid is hit nearer than `hit` tells, which then is updated.
bool Intersect(const Solid& solid, const Ray& ray, Hit* hit) {
  switch (solid.shape) {
    case Shape::kTaperedBox:
      return IntersectTaperedBox(solid, ray, hit);
    case Shape::kFrustum:
      return IntersectFrustum(solid, ray, hit);
    case Shape::kDome:
      return IntersectDome(solid, ray, hit);
  }
  return false;
}

}  // namespace

uint32_t Scene::AddMaterial(const Material& material) {
  materials_.push_back(material);
  return static_cast<uint32_t>(materials_.size() - 1);
}

void Scene::AddTaperedBox(uint32_t material, const Vector3f& base, const Vector2f& bottom,
                          const Vector2f& top, float height, float yaw) {
  Solid solid;
  solid.shape = Shape::kTaperedBox;
  solid.material = material;
  solid.base = base;
  solid.bottom = bottom;
  solid.top = top;
  solid.height = height;
  solid.cos_yaw = std::cos(yaw);
  solid.sin_yaw = std::sin(yaw);
  AddSolid(solid);
}

void Scene::AddFrustum(uint32_t material, const Vector3f& base, float bottom_radius,
                       float top_radius, float height) {
  Solid solid;
  solid.shape = Shape::kFrustum;
  solid.material = material;
  solid.base = base;
  solid.bottom.x() = bottom_radius;
  solid.top.x() = top_radius;
  solid.height = height;
  AddSolid(solid);
}

void Scene::AddDome(uint32_t material, const Vector3f& base, float radius) {
  Solid solid;
  solid.shape = Shape::kDome;
  solid.material = material;
  solid.base = base;
  solid.bottom.x() = radius;
  solid.height = radius;
  AddSolid(solid);
}

void Scene::AddSolid(Solid solid) {
  const Vector2f extent = solid.bottom.cwiseMax(solid.top);
  solid.bound_center = solid.base + 0.5f * solid.height * Vector3f::UnitZ();
  solid.bound_radius = Vector3f(extent.x(), extent.y(), 0.5f * solid.height).norm();
  solids_.push_back(solid);
}

void Scene::SetLight(const Vector3f& sun_direction, const Vector3f& sky_color,
                     const Vector3f& lawn_color) {
  sun_direction_ = sun_direction.normalized();
  sky_color_ = sky_color;
  lawn_color_ = lawn_color;
}

std::vector<uint32_t> Scene::SolidsInCone(const Ray& axis, float half_angle) const {
  std::vector<uint32_t> indices;
  for (size_t i = 0; i < solids_.size(); ++i) {
    const Vector3f to_center = solids_[i].bound_center - axis.origin;
    const float distance = to_center.norm();
    const float cosine = std::clamp(to_center.dot(axis.direction) / distance, -1.0f, 1.0f);
    if (distance <= solids_[i].bound_radius ||
        std::acos(cosine) <= half_angle + std::asin(solids_[i].bound_radius / distance)) {
      indices.push_back(static_cast<uint32_t>(i));
    }
  }
  return indices;
}

bool Scene::InShadow(const Vector3f& position) const {
  const Ray ray{position, sun_direction_};
  for (const Solid& solid : solids_) {
    const Vector3f to_center = solid.bound_center - position;
    const float along = to_center.dot(sun_direction_);
    const float squared_radius = solid.bound_radius * solid.bound_radius;
    if (along < -solid.bound_radius || to_center.squaredNorm() - along * along > squared_radius) {
      continue;
    }
    Hit hit;
    if (Intersect(solid, ray, &hit)) return true;
  }
  return false;
}

// A sky paler towards the horizon above a plain lawn: nothing there has features.
Vector3f Scene::Background(const Vector3f& direction) const {
  const Vector3f haze = 0.5f * sky_color_ + Vector3f::Constant(0.45f);
  if (direction.z() >= 0.0f) {
    const float t = std::min(1.0f, 2.0f * direction.z());
    return haze + t * (sky_color_ - haze);
  }
  const float t = std::min(1.0f, -12.0f * direction.z());
  return haze + t * (lawn_color_ - haze);
}

Vector3f Scene::Trace(const Ray& ray, const std::vector<uint32_t>& solids,
                      float pixel_angle) const {
  Hit hit;
  uint32_t nearest = 0;
  bool found = false;
  for (const uint32_t index : solids) {
    if (Intersect(solids_[index], ray, &hit)) {
      nearest = index;
      found = true;
    }
  }
  if (!found) return Background(ray.direction);

  SurfacePoint point;
  point.position = ray.origin + hit.distance * ray.direction;
  point.normal = hit.normal;
  point.uv = hit.uv;
  point.face_id = 8 * nearest + hit.face;
  const Vector3f color =
      SurfaceColor(materials_[solids_[nearest].material], point, seed_, hit.distance * pixel_angle);

  const float facing = hit.normal.dot(sun_direction_);
  float sun = 0.0f;
  if (facing > 0.0f && !InShadow(point.position + kMinDistance * hit.normal)) sun = facing;
  // Less of the sky is seen near the ground and under overhangs.
  const float openness = 0.75f + 0.25f * std::min(1.0f, 0.6f * point.position.z());
  const float ambient = openness * (0.72f + 0.12f * hit.normal.z());
  return color * (ambient + 0.65f * sun);
}

}  // namespace colmap_graphmatch::synthetic
