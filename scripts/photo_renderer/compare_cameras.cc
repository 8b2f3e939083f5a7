// Compares COLMAP models of rendered photos with the cameras that took them.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <boost/program_options.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "scripts/photo_renderer/cameras.h"

namespace colmap_graphmatch::synthetic {
namespace {

// A similarity of camera centres is determined by no fewer.
constexpr size_t kMinNumPhotos = 3;

struct Comparison {
  std::string model;
  int monument = -1;
  size_t num_registered = 0;
  size_t num_photos = 0;
  // Positions as fractions of the RMS distance of the monument's cameras from their mean.
  double median_position_error = std::numeric_limits<double>::infinity();
  double max_position_error = std::numeric_limits<double>::infinity();
  double median_degrees = 180.0;
  double max_degrees = 180.0;

  double RegisteredFraction() const {
    return static_cast<double>(num_registered) / static_cast<double>(num_photos);
  }
};

// Reads images.txt, where each image has a line of its pose and one of its points.
std::vector<Photo> ReadModel(const std::string& directory) {
  const std::string path = (std::filesystem::path(directory) / "images.txt").string();
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<Photo> photos;
  std::string line;
  while (std::getline(file, line)) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    Photo photo;
    Eigen::Quaterniond& q = photo.world_to_camera;
    Eigen::Vector3d translation;
    long image_id = 0;
    long camera_id = 0;
    if (!(fields >> image_id >> q.w() >> q.x() >> q.y() >> q.z() >> translation.x() >>
          translation.y() >> translation.z() >> camera_id >> std::ws) ||
        !std::getline(fields, photo.name)) {
      throw std::runtime_error(path + ": not the line of an image: " + line.substr(0, 60));
    }
    q.normalize();
    photo.center = -(q.conjugate() * translation);
    photos.push_back(photo);
    // The points, which may be none: that line then is empty, but there.
    std::getline(file, line);
  }
  return photos;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

double RmsRadius(const Truth& truth, int monument) {
  std::vector<Eigen::Vector3d> centers;
  for (const Photo& photo : truth.photos) {
    if (photo.monument == monument) centers.push_back(photo.center);
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& center : centers) mean += center;
  mean /= static_cast<double>(centers.size());
  double sum = 0.0;
  for (const Eigen::Vector3d& center : centers) sum += (center - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(centers.size()));
}

void CompareAligned(const std::vector<const Photo*>& true_photos, const std::vector<Photo>& photos,
                    double radius, Comparison* comparison) {
  const Eigen::Index size = static_cast<Eigen::Index>(photos.size());
  Eigen::Matrix3Xd from(3, size);
  Eigen::Matrix3Xd to(3, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    from.col(i) = photos[static_cast<size_t>(i)].center;
    to.col(i) = true_photos[static_cast<size_t>(i)]->center;
  }
  const Eigen::Matrix4d similarity = Eigen::umeyama(from, to);
  const Eigen::Matrix3d scaled_rotation = similarity.topLeftCorner<3, 3>();
  const Eigen::Matrix3d rotation = scaled_rotation / std::cbrt(scaled_rotation.determinant());
  const Eigen::Quaterniond model_to_world(rotation);

  std::vector<double> position_errors;
  std::vector<double> degrees;
  for (size_t i = 0; i < photos.size(); ++i) {
    const Eigen::Vector3d center =
        scaled_rotation * photos[i].center + similarity.topRightCorner<3, 1>();
    position_errors.push_back((center - true_photos[i]->center).norm() / radius);
    const Eigen::Quaterniond aligned = photos[i].world_to_camera * model_to_world.conjugate();
    const double radians = aligned.angularDistance(true_photos[i]->world_to_camera);
    degrees.push_back(radians * 180.0 / static_cast<double>(EIGEN_PI));
  }
  comparison->median_position_error = Median(position_errors);
  comparison->max_position_error =
      *std::max_element(position_errors.begin(), position_errors.end());
  comparison->median_degrees = Median(degrees);
  comparison->max_degrees = *std::max_element(degrees.begin(), degrees.end());
}

// Adds a line to `failures` if the model is no model of one monument.
Comparison Compare(const Truth& truth, const std::string& directory,
                   std::vector<std::string>* failures) {
  Comparison comparison;
  comparison.model = directory;
  std::map<std::string, const Photo*> by_name;
  for (const Photo& photo : truth.photos) by_name[photo.name] = &photo;

  const std::vector<Photo> photos = ReadModel(directory);
  std::vector<const Photo*> true_photos;
  std::set<int> monuments;
  for (const Photo& photo : photos) {
    const auto found = by_name.find(photo.name);
    if (found == by_name.end()) {
      throw std::runtime_error(directory + " holds a photo that was not rendered: " + photo.name);
    }
    true_photos.push_back(found->second);
    monuments.insert(found->second->monument);
  }
  comparison.num_registered = photos.size();
  if (monuments.size() != 1) {
    failures->push_back(directory + (monuments.empty() ? " holds no photos"
                                                       : " mixes photos of several monuments"));
    return comparison;
  }
  comparison.monument = *monuments.begin();
  for (const Photo& photo : truth.photos) {
    if (photo.monument == comparison.monument) ++comparison.num_photos;
  }
  if (photos.size() >= kMinNumPhotos) {
    CompareAligned(true_photos, photos, RmsRadius(truth, comparison.monument), &comparison);
  }
  return comparison;
}

// The best model of a monument is the one with most photos, then the most accurate.
bool IsBetter(const Comparison& a, const Comparison& b) {
  if (a.num_registered != b.num_registered) return a.num_registered > b.num_registered;
  return a.max_position_error < b.max_position_error;
}

void PrintTable(const std::vector<Comparison>& comparisons) {
  std::printf("monument  registered  position error: median, max  degrees: median, max  model\n");
  for (const Comparison& c : comparisons) {
    std::printf("%8s  %4zu of %-3zu  %22.5f, %.5f  %15.3f, %.3f  %s\n",
                c.monument < 0 ? "none" : std::to_string(c.monument).c_str(), c.num_registered,
                c.num_photos, c.median_position_error, c.max_position_error, c.median_degrees,
                c.max_degrees, c.model.c_str());
  }
}

void CheckMonuments(const Truth& truth, const std::vector<Comparison>& comparisons,
                    double min_registered_fraction, double max_position_error,
                    std::vector<std::string>* failures) {
  std::set<int> monuments;
  for (const Photo& photo : truth.photos) monuments.insert(photo.monument);
  for (const int monument : monuments) {
    const Comparison* best = nullptr;
    for (const Comparison& c : comparisons) {
      if (c.monument == monument && (best == nullptr || IsBetter(c, *best))) best = &c;
    }
    const std::string prefix = "monument " + std::to_string(monument) + ": ";
    if (best == nullptr) {
      failures->push_back(prefix + "no model");
      continue;
    }
    if (best->RegisteredFraction() < min_registered_fraction) {
      failures->push_back(prefix + "only " + std::to_string(best->num_registered) + " of " +
                          std::to_string(best->num_photos) + " photos registered");
    }
    // Negated so that an error that is not a number fails.
    if (!(best->max_position_error <= max_position_error)) {
      failures->push_back(prefix + "a camera is off by " +
                          std::to_string(best->max_position_error) + ", allowed are " +
                          std::to_string(max_position_error));
    }
  }
}

int Run(int argc, char** argv) {
  namespace po = boost::program_options;
  std::string truth_path;
  std::vector<std::string> model_paths;
  double max_position_error = 0.02;
  double min_registered_fraction = 1.0;
  po::options_description options("Compares COLMAP models (text format) with rendered cameras");
  options.add_options()("help", "show this help")("truth_path", po::value(&truth_path)->required(),
                                                  "the file that render_photos wrote")(
      "model_path", po::value(&model_paths)->required()->multitoken()->composing(),
      "directory with images.txt; may be given several times")(
      "max_position_error", po::value(&max_position_error)->default_value(max_position_error),
      "of any camera, as a fraction of the RMS distance of a monument's cameras from their mean")(
      "min_registered_fraction",
      po::value(&min_registered_fraction)->default_value(min_registered_fraction),
      "of the photos of each monument");
  po::variables_map variables;
  po::store(po::parse_command_line(argc, argv, options), variables);
  if (variables.count("help") > 0) {
    std::cout << options;
    return 0;
  }
  po::notify(variables);

  const Truth truth = ReadTruth(truth_path);
  std::vector<std::string> failures;
  std::vector<Comparison> comparisons;
  for (const std::string& model_path : model_paths) {
    comparisons.push_back(Compare(truth, model_path, &failures));
  }
  PrintTable(comparisons);
  CheckMonuments(truth, comparisons, min_registered_fraction, max_position_error, &failures);
  for (const std::string& failure : failures) std::printf("FAILED: %s\n", failure.c_str());
  return failures.empty() ? 0 : 1;
}

}  // namespace
}  // namespace colmap_graphmatch::synthetic

int main(int argc, char** argv) {
  try {
    return colmap_graphmatch::synthetic::Run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "compare_cameras: " << error.what() << std::endl;
    return 1;
  }
}
