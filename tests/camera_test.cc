#include "colmap_graphmatch/geometry/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace colmap_graphmatch {
namespace {

using ::testing::HasSubstr;

Camera MakeCamera(const char* name, std::vector<double> params) {
  Camera camera;
  camera.model_id = FindCameraModel(name)->id;
  camera.width = 1000;
  camera.height = 800;
  camera.params = std::move(params);
  return camera;
}

// Cameras of every model that has an image plane, with strong but possible distortions.
std::vector<Camera> AllCameras() {
  return {
      MakeCamera("SIMPLE_PINHOLE", {700, 500, 400}),
      MakeCamera("PINHOLE", {700, 720, 500, 400}),
      MakeCamera("SIMPLE_RADIAL", {700, 500, 400, 0.1}),
      MakeCamera("SIMPLE_RADIAL", {700, 500, 400, -0.1}),
      MakeCamera("SIMPLE_RADIAL", {700, 500, 400, 0}),
      MakeCamera("RADIAL", {700, 500, 400, 0.1, -0.02}),
      MakeCamera("OPENCV", {700, 720, 500, 400, -0.1, 0.02, 0.002, -0.001}),
      MakeCamera("OPENCV_FISHEYE", {700, 720, 500, 400, 0.05, 0.01, -0.01, 0.002}),
      MakeCamera("FULL_OPENCV",
                 {700, 720, 500, 400, -0.1, 0.02, 0.002, -0.001, 0.01, 0.02, -0.01, 0.005}),
      MakeCamera("FOV", {700, 720, 500, 400, 0.9}),
      MakeCamera("FOV", {700, 720, 500, 400, 1e-6}),
      MakeCamera("SIMPLE_RADIAL_FISHEYE", {700, 500, 400, 0.05}),
      MakeCamera("RADIAL_FISHEYE", {700, 500, 400, 0.05, -0.01}),
      MakeCamera("THIN_PRISM_FISHEYE",
                 {700, 720, 500, 400, 0.05, 0.01, 0.001, -0.002, 0.003, 0.001, 0.002, -0.001}),
      MakeCamera("RAD_TAN_THIN_PRISM_FISHEYE",
                 {700, 720, 500, 400, 0.05, 0.01, -0.01, 0.002, 0.001, -0.001, 0.001, -0.002, 0.001,
                  0.002, -0.001, 0.001}),
      MakeCamera("SIMPLE_DIVISION", {700, 500, 400, -0.2}),
      MakeCamera("DIVISION", {700, 720, 500, 400, 0.1}),
      MakeCamera("SIMPLE_FISHEYE", {700, 500, 400}),
      MakeCamera("FISHEYE", {700, 720, 500, 400}),
      MakeCamera("EUCM", {700, 720, 500, 400, 0.6, 1.1}),
  };
}

const char* NameOf(const Camera& camera) { return FindCameraModel(camera.model_id)->name; }

TEST(CameraModels, AreColmaps) {
  const std::pair<const char*, std::size_t> models[] = {
      {"SIMPLE_PINHOLE", 3},
      {"PINHOLE", 4},
      {"SIMPLE_RADIAL", 4},
      {"RADIAL", 5},
      {"OPENCV", 8},
      {"OPENCV_FISHEYE", 8},
      {"FULL_OPENCV", 12},
      {"FOV", 5},
      {"SIMPLE_RADIAL_FISHEYE", 4},
      {"RADIAL_FISHEYE", 5},
      {"THIN_PRISM_FISHEYE", 12},
      {"RAD_TAN_THIN_PRISM_FISHEYE", 16},
      {"SIMPLE_DIVISION", 4},
      {"DIVISION", 5},
      {"SIMPLE_FISHEYE", 3},
      {"FISHEYE", 4},
      {"EUCM", 6},
      {"EQUIRECTANGULAR", 2},
  };
  int id = 0;
  for (const auto& [name, num_params] : models) {
    const CameraModel* model = FindCameraModel(id);
    ASSERT_NE(model, nullptr);
    EXPECT_STREQ(model->name, name);
    EXPECT_EQ(model->id, id);
    EXPECT_EQ(model->num_params, num_params);
    EXPECT_EQ(FindCameraModel(name), model);
    ++id;
  }
  EXPECT_EQ(FindCameraModel(id), nullptr);
  EXPECT_EQ(FindCameraModel(-1), nullptr);
  EXPECT_EQ(FindCameraModel("NONE"), nullptr);
}

TEST(CameraModels, EveryPixelComesBack) {
  for (const Camera& camera : AllCameras()) {
    ASSERT_EQ(WhyNotUsable(camera), std::nullopt) << NameOf(camera);
    for (double x = 0; x <= 1000; x += 100) {
      for (double y = 0; y <= 800; y += 100) {
        double u = 0;
        double v = 0;
        ASSERT_TRUE(ToNormalizedPlane(camera, x, y, &u, &v)) << NameOf(camera) << x << ' ' << y;
        double x_again = 0;
        double y_again = 0;
        ASSERT_TRUE(ToPixel(camera, u, v, &x_again, &y_again));
        EXPECT_NEAR(x_again, x, 1e-5) << NameOf(camera);
        EXPECT_NEAR(y_again, y, 1e-5) << NameOf(camera);
      }
    }
  }
}

// Values by COLMAP's formulae, one at a time.
TEST(CameraModels, ProjectAsColmapDoes) {
  const double u = 0.3;
  const double v = -0.2;
  const double r2 = u * u + v * v;
  const double r = std::sqrt(r2);
  const auto expect = [&](const Camera& camera, double du, double dv) {
    double x = 0;
    double y = 0;
    ASSERT_TRUE(ToPixel(camera, u, v, &x, &y));
    const PinholeParams k = PinholePart(camera);
    EXPECT_NEAR(x, k.fx * du + k.cx, 1e-9) << NameOf(camera);
    EXPECT_NEAR(y, k.fy * dv + k.cy, 1e-9) << NameOf(camera);
  };
  expect(MakeCamera("SIMPLE_PINHOLE", {700, 500, 400}), u, v);
  expect(MakeCamera("SIMPLE_RADIAL", {700, 500, 400, 0.1}), u * (1 + 0.1 * r2), v * (1 + 0.1 * r2));
  const double radial = 1 + 0.1 * r2 - 0.02 * r2 * r2;
  expect(MakeCamera("RADIAL", {700, 500, 400, 0.1, -0.02}), u * radial, v * radial);
  expect(MakeCamera("OPENCV", {700, 720, 500, 400, 0.1, -0.02, 0.003, -0.004}),
         u * radial + 2 * 0.003 * u * v - 0.004 * (r2 + 2 * u * u),
         v * radial - 2 * 0.004 * u * v + 0.003 * (r2 + 2 * v * v));
  const double theta = std::atan(r);
  const double t2 = theta * theta;
  expect(MakeCamera("OPENCV_FISHEYE", {700, 720, 500, 400, 0.1, 0.02, 0.03, 0.04}),
         u / r * theta *
             (1 + 0.1 * t2 + 0.02 * t2 * t2 + 0.03 * t2 * t2 * t2 + 0.04 * t2 * t2 * t2 * t2),
         v / r * theta *
             (1 + 0.1 * t2 + 0.02 * t2 * t2 + 0.03 * t2 * t2 * t2 + 0.04 * t2 * t2 * t2 * t2));
  const double quotient = (1 + 0.1 * r2 + 0.02 * r2 * r2 + 0.05 * r2 * r2 * r2) /
                          (1 + 0.06 * r2 + 0.07 * r2 * r2 + 0.08 * r2 * r2 * r2);
  expect(MakeCamera("FULL_OPENCV",
                    {700, 720, 500, 400, 0.1, 0.02, 0.003, 0.004, 0.05, 0.06, 0.07, 0.08}),
         u * quotient + 2 * 0.003 * u * v + 0.004 * (r2 + 2 * u * u),
         v * quotient + 2 * 0.004 * u * v + 0.003 * (r2 + 2 * v * v));
  const double fov = std::atan(r * 2 * std::tan(0.45)) / (r * 0.9);
  expect(MakeCamera("FOV", {700, 720, 500, 400, 0.9}), u * fov, v * fov);
  expect(MakeCamera("FISHEYE", {700, 720, 500, 400}), u * theta / r, v * theta / r);
  // x = (1 + k |x|^2) u
  const double division = 2 / (1 + std::sqrt(1 - 4 * r2 * -0.2));
  expect(MakeCamera("SIMPLE_DIVISION", {700, 500, 400, -0.2}), u * division, v * division);
  const double depth = 0.6 * std::sqrt(1.1 * r2 + 1) + 0.4;
  expect(MakeCamera("EUCM", {700, 720, 500, 400, 0.6, 1.1}), u / depth, v / depth);
  // What follows the angle, of a, b.
  const double a = u * theta / r;
  const double b = v * theta / r;
  const double thin =
      1 + 0.1 * t2 + 0.02 * t2 * t2 + 0.05 * t2 * t2 * t2 + 0.06 * t2 * t2 * t2 * t2;
  expect(MakeCamera("THIN_PRISM_FISHEYE",
                    {700, 720, 500, 400, 0.1, 0.02, 0.003, 0.004, 0.05, 0.06, 0.007, 0.008}),
         a * thin + 2 * 0.003 * a * b + 0.004 * (t2 + 2 * a * a) + 0.007 * t2,
         b * thin + 2 * 0.004 * a * b + 0.003 * (t2 + 2 * b * b) + 0.008 * t2);
  const double c = a * (1 + 0.1 * t2);
  const double d = b * (1 + 0.1 * t2);
  const double s = c * c + d * d;
  expect(MakeCamera("RAD_TAN_THIN_PRISM_FISHEYE", {700, 720, 500, 400, 0.1, 0, 0, 0, 0, 0, 0.002,
                                                   0.003, 0.004, 0.005, 0.006, 0.007}),
         c + 2 * 0.003 * c * d + 0.002 * (s + 2 * c * c) + 0.004 * s + 0.005 * s * s,
         d + 2 * 0.002 * c * d + 0.003 * (s + 2 * d * d) + 0.006 * s + 0.007 * s * s);
}

TEST(CameraModels, WithoutDistortionAllPinholeModelsAreOne) {
  for (const Camera& camera :
       {MakeCamera("OPENCV", {700, 720, 500, 400, 0, 0, 0, 0}),
        MakeCamera("FULL_OPENCV", {700, 720, 500, 400, 0, 0, 0, 0, 0, 0, 0, 0}),
        MakeCamera("DIVISION", {700, 720, 500, 400, 0}),
        MakeCamera("EUCM", {700, 720, 500, 400, 0, 1})}) {
    double u = 0;
    double v = 0;
    ASSERT_TRUE(ToNormalizedPlane(camera, 850, 40, &u, &v));
    EXPECT_DOUBLE_EQ(u, 0.5);
    EXPECT_DOUBLE_EQ(v, -0.5);
    EXPECT_EQ(MeanFocalLength(camera), 710);
  }
}

TEST(CameraModels, APixelWithoutARayIsRefused) {
  double u = 0;
  double v = 0;
  // A right angle from the axis, and more.
  EXPECT_FALSE(ToNormalizedPlane(MakeCamera("FISHEYE", {100, 100, 0, 0}), 158, 0, &u, &v));
  EXPECT_FALSE(ToNormalizedPlane(MakeCamera("FOV", {100, 100, 0, 0, 1}), 158, 0, &u, &v));
  EXPECT_FALSE(ToNormalizedPlane(MakeCamera("SIMPLE_DIVISION", {100, 0, 0, -1}), 101, 0, &u, &v));
  EXPECT_FALSE(ToNormalizedPlane(MakeCamera("EUCM", {100, 100, 0, 0, 0.9, 1}), 200, 0, &u, &v));
  // Beyond where the distortion turns round: no point gives r = 1.
  EXPECT_FALSE(ToNormalizedPlane(MakeCamera("SIMPLE_RADIAL", {100, 0, 0, -0.5}), 100, 0, &u, &v));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Camera& camera : AllCameras()) {
    EXPECT_FALSE(ToNormalizedPlane(camera, nan, 0, &u, &v));
    EXPECT_FALSE(ToNormalizedPlane(camera, 0, std::numeric_limits<double>::infinity(), &u, &v));
  }
}

TEST(CameraModels, HostileParametersAreRefused) {
  const auto why = [](const char* name, std::vector<double> params) {
    return WhyNotUsable(MakeCamera(name, std::move(params))).value_or("");
  };
  EXPECT_THAT(why("SIMPLE_RADIAL", {0, 500, 400, 0}), HasSubstr("focal length"));
  EXPECT_THAT(why("PINHOLE", {700, -1, 500, 400}), HasSubstr("focal length"));
  EXPECT_THAT(why("SIMPLE_RADIAL", {700, 500, 400}), HasSubstr("4 parameters, not 3"));
  EXPECT_THAT(why("SIMPLE_RADIAL", {700, 500, 400, 0, 0}), HasSubstr("4 parameters, not 5"));
  EXPECT_THAT(why("SIMPLE_RADIAL", {}), HasSubstr("not 0"));
  EXPECT_THAT(why("SIMPLE_RADIAL", {700, 500, 400, std::nan("")}), HasSubstr("finite"));
  EXPECT_THAT(why("EQUIRECTANGULAR", {1000, 500}), HasSubstr("EQUIRECTANGULAR"));
  Camera camera;
  camera.model_id = 99;
  EXPECT_THAT(WhyNotUsable(camera).value_or(""), HasSubstr("99"));
}

// No parameters, however wild, may hang it or give something that is no number.
TEST(CameraModels, WildDistortionsEndInAPointOrARefusal) {
  for (Camera camera : AllCameras()) {
    for (const double wild : {-1e12, -3.0, 1e-300, 3.0, 1e12, 1e300}) {
      for (std::size_t i = FindCameraModel(camera.model_id)->num_focal_lengths + 2;
           i < camera.params.size(); ++i) {
        const double before = camera.params[i];
        camera.params[i] = wild;
        double u = 0;
        double v = 0;
        if (ToNormalizedPlane(camera, 990, 10, &u, &v)) {
          EXPECT_TRUE(std::isfinite(u) && std::isfinite(v));
        }
        camera.params[i] = before;
      }
    }
  }
}

}  // namespace
}  // namespace colmap_graphmatch
