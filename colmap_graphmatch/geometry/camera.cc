#include "colmap_graphmatch/geometry/camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace colmap_graphmatch {
namespace {

// -Wswitch asks for a new model wherever models differ.
enum ModelId : int {
  kSimplePinhole = 0,
  kPinhole = 1,
  kSimpleRadial = 2,
  kRadial = 3,
  kOpenCv = 4,
  kOpenCvFisheye = 5,
  kFullOpenCv = 6,
  kFov = 7,
  kSimpleRadialFisheye = 8,
  kRadialFisheye = 9,
  kThinPrismFisheye = 10,
  kRadTanThinPrismFisheye = 11,
  kSimpleDivision = 12,
  kDivision = 13,
  kSimpleFisheye = 14,
  kFisheye = 15,
  kEucm = 16,
  kEquirectangular = 17,
};

constexpr std::array<CameraModel, 18> kModels = {{
    {kSimplePinhole, "SIMPLE_PINHOLE", 1, 3, Projection::kPerspective},
    {kPinhole, "PINHOLE", 2, 4, Projection::kPerspective},
    {kSimpleRadial, "SIMPLE_RADIAL", 1, 4, Projection::kPerspective},
    {kRadial, "RADIAL", 1, 5, Projection::kPerspective},
    {kOpenCv, "OPENCV", 2, 8, Projection::kPerspective},
    {kOpenCvFisheye, "OPENCV_FISHEYE", 2, 8, Projection::kFisheye},
    {kFullOpenCv, "FULL_OPENCV", 2, 12, Projection::kPerspective},
    {kFov, "FOV", 2, 5, Projection::kOwnFormula},
    {kSimpleRadialFisheye, "SIMPLE_RADIAL_FISHEYE", 1, 4, Projection::kFisheye},
    {kRadialFisheye, "RADIAL_FISHEYE", 1, 5, Projection::kFisheye},
    {kThinPrismFisheye, "THIN_PRISM_FISHEYE", 2, 12, Projection::kFisheye},
    {kRadTanThinPrismFisheye, "RAD_TAN_THIN_PRISM_FISHEYE", 2, 16, Projection::kFisheye},
    {kSimpleDivision, "SIMPLE_DIVISION", 1, 4, Projection::kOwnFormula},
    {kDivision, "DIVISION", 2, 5, Projection::kOwnFormula},
    {kSimpleFisheye, "SIMPLE_FISHEYE", 1, 3, Projection::kFisheye},
    {kFisheye, "FISHEYE", 2, 4, Projection::kFisheye},
    {kEucm, "EUCM", 2, 6, Projection::kOwnFormula},
    {kEquirectangular, "EQUIRECTANGULAR", 0, 2, Projection::kSpherical},
}};

constexpr bool RowsAreIds() {
  for (std::size_t i = 0; i < kModels.size(); ++i) {
    if (kModels[i].id != static_cast<int>(i)) return false;
  }
  return true;
}
static_assert(RowsAreIds(), "A model is found by its id as the row.");

struct Point {
  double u;
  double v;
};

// k[0] r^2 + k[1] r^4 + ...
double Radial(const double* k, int num, double squared_radius) {
  double sum = 0;
  for (int i = num - 1; i >= 0; --i) sum = (sum + k[i]) * squared_radius;
  return sum;
}

// Brown's tangential distortion, p before q.
Point Tangential(double p, double q, Point at) {
  const double squared_radius = at.u * at.u + at.v * at.v;
  return {2 * p * at.u * at.v + q * (squared_radius + 2 * at.u * at.u),
          2 * q * at.u * at.v + p * (squared_radius + 2 * at.v * at.v)};
}

// The point with its distortion; extra: the parameters after the principal point.
Point Distorted(ModelId model, const double* extra, Point at) {
  const double squared_radius = at.u * at.u + at.v * at.v;
  const auto scaled = [&](double more) { return Point{at.u * (1 + more), at.v * (1 + more)}; };
  switch (model) {
    case kSimpleRadial:
    case kSimpleRadialFisheye:
      return scaled(Radial(extra, 1, squared_radius));
    case kRadial:
    case kRadialFisheye:
      return scaled(Radial(extra, 2, squared_radius));
    case kOpenCvFisheye:
      return scaled(Radial(extra, 4, squared_radius));
    case kOpenCv: {
      const Point radial = scaled(Radial(extra, 2, squared_radius));
      const Point tangential = Tangential(extra[2], extra[3], at);
      return {radial.u + tangential.u, radial.v + tangential.v};
    }
    case kFullOpenCv: {
      const double above[3] = {extra[0], extra[1], extra[4]};
      const double factor =
          (1 + Radial(above, 3, squared_radius)) / (1 + Radial(extra + 5, 3, squared_radius));
      const Point tangential = Tangential(extra[2], extra[3], at);
      return {at.u * factor + tangential.u, at.v * factor + tangential.v};
    }
    case kThinPrismFisheye: {
      const double k[4] = {extra[0], extra[1], extra[4], extra[5]};
      const Point radial = scaled(Radial(k, 4, squared_radius));
      const Point tangential = Tangential(extra[2], extra[3], at);
      return {radial.u + tangential.u + extra[6] * squared_radius,
              radial.v + tangential.v + extra[7] * squared_radius};
    }
    case kRadTanThinPrismFisheye: {
      // What follows the radial distortion is a function of the point that it gives.
      const Point radial = scaled(Radial(extra, 6, squared_radius));
      // p0 and p1 of this model are what p2 and p1 are in OPENCV: COLMAP has them in this order.
      const Point tangential = Tangential(extra[7], extra[6], radial);
      const double square = radial.u * radial.u + radial.v * radial.v;
      return {radial.u + tangential.u + Radial(extra + 8, 2, square),
              radial.v + tangential.v + Radial(extra + 10, 2, square)};
    }
    case kSimplePinhole:
    case kPinhole:
    case kSimpleFisheye:
    case kFisheye:
      return at;  // They have no distortion.
    case kFov:
    case kSimpleDivision:
    case kDivision:
    case kEucm:
    case kEquirectangular:
      break;  // They do not come here.
  }
  return at;
}

// What Distorted gives `target` for: Newton's steps, no longer than a tenth of the point's radius
// (or a tenth), derivatives by differences. As COLMAP does it, so that the same of several
// solutions is found.
bool Undistort(ModelId model, const double* extra, Point target, Point* result) {
  constexpr int kMaxSteps = 100;
  constexpr double kStepRadius = 0.1;
  constexpr double kDifference = 1e-6;
  constexpr double kLeastSquaredStep = 1e-20;
  Point at = target;
  for (int i = 0; i < kMaxSteps; ++i) {
    const Point value = Distorted(model, extra, at);
    const double d = kDifference * std::max({1.0, std::abs(at.u), std::abs(at.v)});
    const Point right = Distorted(model, extra, {at.u + d, at.v});
    const Point left = Distorted(model, extra, {at.u - d, at.v});
    const Point below = Distorted(model, extra, {at.u, at.v + d});
    const Point above = Distorted(model, extra, {at.u, at.v - d});
    const double a = (right.u - left.u) / (2 * d);
    const double b = (below.u - above.u) / (2 * d);
    const double c = (right.v - left.v) / (2 * d);
    const double e = (below.v - above.v) / (2 * d);
    const double determinant = a * e - b * c;
    const double du = value.u - target.u;
    const double dv = value.v - target.v;
    double step_u = (e * du - b * dv) / determinant;
    double step_v = (a * dv - c * du) / determinant;
    const double square = step_u * step_u + step_v * step_v;
    if (!std::isfinite(square)) return false;
    const double radius = kStepRadius * std::max(1.0, std::sqrt(at.u * at.u + at.v * at.v));
    if (square > radius * radius) {
      const double factor = radius / std::sqrt(square);
      step_u *= factor;
      step_v *= factor;
    }
    at.u -= step_u;
    at.v -= step_v;
    if (square < kLeastSquaredStep * std::max(1.0, at.u * at.u + at.v * at.v)) {
      *result = at;
      return true;
    }
  }
  return false;
}

bool IsDistorting(const double* extra, std::size_t num) {
  return std::any_of(extra, extra + num, [](double value) { return value != 0; });
}

// Of the field-of-view model (Devernay and Faugeras, 2001), below which series stand in for it.
constexpr double kSmallAngle = 1e-4;

double FovFactor(double omega, double squared_radius) {
  const double square = omega * omega;
  if (square < kSmallAngle) return square * squared_radius / 3 - square / 12 + 1;
  const double tangent = std::tan(omega / 2);
  if (squared_radius < kSmallAngle) {
    return -2 * tangent * (4 * squared_radius * tangent * tangent - 3) / (3 * omega);
  }
  const double radius = std::sqrt(squared_radius);
  return std::atan(radius * 2 * tangent) / (radius * omega);
}

double InverseFovFactor(double omega, double squared_radius) {
  const double square = omega * omega;
  if (square < kSmallAngle) return square * squared_radius / 3 - square / 12 + 1;
  const double tangent = std::tan(omega / 2);
  if (squared_radius < kSmallAngle) {
    return omega * (square * squared_radius + 3) / (6 * tangent);
  }
  const double radius = std::sqrt(squared_radius);
  // From a right angle on there is no point on the plane.
  if (!(radius * std::abs(omega) < M_PI / 2)) return std::numeric_limits<double>::quiet_NaN();
  return std::tan(radius * omega) / (radius * 2 * tangent);
}

enum class Way { kToPlane, kFromPlane };

// What a model with a formula of its own multiplies u and v by. Not finite: there is no such point.
double FormulaFactor(ModelId model, Way way, const double* extra, double squared_radius) {
  constexpr double kNoPoint = std::numeric_limits<double>::quiet_NaN();
  switch (model) {
    case kFov:
      return way == Way::kToPlane ? InverseFovFactor(extra[0], squared_radius)
                                  : FovFactor(extra[0], squared_radius);
    case kSimpleDivision:
    case kDivision: {
      if (way == Way::kFromPlane) return 2 / (1 + std::sqrt(1 - 4 * squared_radius * extra[0]));
      const double depth = 1 + extra[0] * squared_radius;
      return depth > 0 ? 1 / depth : kNoPoint;
    }
    case kEucm: {
      const double alpha = extra[0];
      const double beta = extra[1];
      double depth = alpha * std::sqrt(beta * squared_radius + 1) + 1 - alpha;
      if (way == Way::kToPlane) {
        const double radicand = 1 - (2 * alpha - 1) * beta * squared_radius;
        const double numerator = 1 - alpha * alpha * beta * squared_radius;
        depth = numerator / (alpha * std::sqrt(radicand) + 1 - alpha);
      }
      return depth > 0 ? 1 / depth : kNoPoint;
    }
    case kSimplePinhole:
    case kPinhole:
    case kSimpleRadial:
    case kRadial:
    case kOpenCv:
    case kOpenCvFisheye:
    case kFullOpenCv:
    case kSimpleRadialFisheye:
    case kRadialFisheye:
    case kThinPrismFisheye:
    case kRadTanThinPrismFisheye:
    case kSimpleFisheye:
    case kFisheye:
    case kEquirectangular:
      break;  // They do not come here.
  }
  return kNoPoint;
}

Point ByFormula(ModelId model, Way way, const double* extra, Point at) {
  const double factor = FormulaFactor(model, way, extra, at.u * at.u + at.v * at.v);
  return {at.u * factor, at.v * factor};
}

const CameraModel& ModelOf(const Camera& camera) {
  return kModels[static_cast<std::size_t>(camera.model_id)];
}

bool IsFinite(Point point) { return std::isfinite(point.u) && std::isfinite(point.v); }

}  // namespace

const CameraModel* FindCameraModel(int id) {
  if (id < 0 || id >= static_cast<int>(kModels.size())) return nullptr;
  return &kModels[static_cast<std::size_t>(id)];
}

const CameraModel* FindCameraModel(std::string_view name) {
  const auto found = std::find_if(kModels.begin(), kModels.end(),
                                  [&](const CameraModel& model) { return model.name == name; });
  return found == kModels.end() ? nullptr : &*found;
}

std::optional<std::string> WhyNotUsable(const Camera& camera) {
  const CameraModel* model = FindCameraModel(camera.model_id);
  if (model == nullptr) return "its model, " + std::to_string(camera.model_id) + ", is unknown";
  if (model->projection == Projection::kSpherical) {
    return std::string("its model, ") + model->name + ", has no image plane";
  }
  if (camera.params.size() != model->num_params) {
    return std::string("its model, ") + model->name + ", has " + std::to_string(model->num_params) +
           " parameters, not " + std::to_string(camera.params.size());
  }
  if (!std::all_of(camera.params.begin(), camera.params.end(),
                   [](double value) { return std::isfinite(value); })) {
    return "a parameter is not a finite number";
  }
  for (std::size_t i = 0; i < model->num_focal_lengths; ++i) {
    if (!(camera.params[i] > 0)) return "a focal length is not above 0";
  }
  return std::nullopt;
}

PinholeParams PinholePart(const Camera& camera) {
  const std::vector<double>& params = camera.params;
  if (ModelOf(camera).num_focal_lengths == 1) {
    return {params[0], params[0], params[1], params[2]};
  }
  return {params[0], params[1], params[2], params[3]};
}

double MeanFocalLength(const Camera& camera) {
  const PinholeParams pinhole = PinholePart(camera);
  return (pinhole.fx + pinhole.fy) / 2;
}

bool ToNormalizedPlane(const Camera& camera, double x, double y, double* u, double* v) {
  const CameraModel& model = ModelOf(camera);
  const auto id = static_cast<ModelId>(model.id);
  const PinholeParams pinhole = PinholePart(camera);
  const std::size_t num_pinhole = model.num_focal_lengths + 2;
  const double* extra = camera.params.data() + num_pinhole;
  Point at = {(x - pinhole.cx) / pinhole.fx, (y - pinhole.cy) / pinhole.fy};
  if (!IsFinite(at)) return false;
  if (model.projection == Projection::kOwnFormula) {
    at = ByFormula(id, Way::kToPlane, extra, at);
  } else {
    if (IsDistorting(extra, model.num_params - num_pinhole) && !Undistort(id, extra, at, &at)) {
      return false;
    }
    if (model.projection == Projection::kFisheye) {
      const double angle = std::sqrt(at.u * at.u + at.v * at.v);
      if (!(angle < M_PI / 2)) return false;
      const double factor = angle > 0 ? std::tan(angle) / angle : 1;
      at = {at.u * factor, at.v * factor};
    }
  }
  *u = at.u;
  *v = at.v;
  return IsFinite(at);
}

bool ToPixel(const Camera& camera, double u, double v, double* x, double* y) {
  const CameraModel& model = ModelOf(camera);
  const auto id = static_cast<ModelId>(model.id);
  const PinholeParams pinhole = PinholePart(camera);
  const double* extra = camera.params.data() + model.num_focal_lengths + 2;
  Point at = {u, v};
  if (model.projection == Projection::kOwnFormula) {
    at = ByFormula(id, Way::kFromPlane, extra, at);
  } else {
    if (model.projection == Projection::kFisheye) {
      const double radius = std::sqrt(u * u + v * v);
      const double factor = radius > 0 ? std::atan(radius) / radius : 1;
      at = {u * factor, v * factor};
    }
    at = Distorted(id, extra, at);
  }
  *x = pinhole.fx * at.u + pinhole.cx;
  *y = pinhole.fy * at.v + pinhole.cy;
  return std::isfinite(*x) && std::isfinite(*y);
}

}  // namespace colmap_graphmatch
