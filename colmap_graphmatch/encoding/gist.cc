#include "colmap_graphmatch/encoding/gist.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"

namespace colmap_graphmatch {
namespace {

constexpr int kSize = 256;  // Of the scaled photo.
constexpr int kNumScales = 4;
constexpr int kNumOrientations = 8;
constexpr int kNumCells = 4;  // In each direction.
static_assert(kGistDim == std::size_t{kNumScales} * kNumOrientations * kNumCells * kNumCells);

// Pixels that are added at every side, mirrored, so that the Fourier transform does not join
// opposite sides: around the photo for the normalisation, then for the filters.
constexpr int kContrastPadding = 5;
constexpr int kFilterPadding = 32;

// The coordinate of an entry of a transform: 0, 1, ..., n/2 - 1, -n/2, ..., -1.
float Frequency(int i, int n) { return static_cast<float>(i < n / 2 ? i : i - n); }

cv::Mat Transform(const cv::Mat& image) {
  cv::Mat spectrum;
  cv::dft(image, spectrum, cv::DFT_COMPLEX_OUTPUT);
  return spectrum;
}

// The inverse transform of a spectrum times real factors.
cv::Mat Filter(const cv::Mat& spectrum, const cv::Mat& factors) {
  cv::Mat product;
  cv::multiply(spectrum, factors, product);
  cv::idft(product, product, cv::DFT_SCALE);
  return product;
}

// One real number for both parts of every entry.
cv::Mat ForBothParts(const cv::Mat& real) {
  cv::Mat both;
  cv::merge(std::vector<cv::Mat>{real, real}, both);
  return both;
}

cv::Mat Real(const cv::Mat& complex) {
  cv::Mat real;
  cv::extractChannel(complex, real, 0);
  return real;
}

// Whitens the photo and divides it by its local contrast.
cv::Mat NormaliseContrast(const cv::Mat& grey) {
  constexpr double kCyclesAnImage = 4;
  constexpr double kLeastContrast = 0.2;
  cv::Mat image;
  grey.convertTo(image, CV_32F);
  image += 1;
  cv::log(image, image);
  cv::copyMakeBorder(image, image, kContrastPadding, kContrastPadding, kContrastPadding,
                     kContrastPadding, cv::BORDER_REFLECT);
  const int n = image.rows;
  const double sigma = kCyclesAnImage / std::sqrt(std::log(2.0));
  cv::Mat low_pass(n, n, CV_32F);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const double square = std::pow(Frequency(x, n), 2) + std::pow(Frequency(y, n), 2);
      low_pass.at<float>(y, x) = static_cast<float>(std::exp(-square / (sigma * sigma)));
    }
  }
  low_pass = ForBothParts(low_pass);
  image -= Real(Filter(Transform(image), low_pass));
  cv::Mat contrast = cv::abs(Real(Filter(Transform(image.mul(image)), low_pass)));
  cv::sqrt(contrast, contrast);
  contrast += kLeastContrast;
  cv::divide(image, contrast, image);
  return image(cv::Rect(kContrastPadding, kContrastPadding, kSize, kSize)).clone();
}

// The transfer functions of the Gabor filters, one after the other.
std::vector<cv::Mat> MakeFilters() {
  constexpr float kPi = 3.14159265358979F;
  constexpr int n = kSize + 2 * kFilterPadding;
  std::vector<cv::Mat> filters;
  for (int scale = 0; scale < kNumScales; ++scale) {
    const float centre = 0.3F / std::pow(1.85F, static_cast<float>(scale)) * n;
    const float narrowness = 16.0F * kNumOrientations * kNumOrientations / (32 * 32);
    for (int orientation = 0; orientation < kNumOrientations; ++orientation) {
      cv::Mat filter(n, n, CV_32F);
      for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
          const float fx = Frequency(x, n);
          const float fy = Frequency(y, n);
          const float radius = std::sqrt(fx * fx + fy * fy) / centre - 1;
          float angle =
              std::atan2(fy, fx) + kPi / kNumOrientations * static_cast<float>(orientation);
          if (angle > kPi) angle -= 2 * kPi;
          filter.at<float>(y, x) =
              std::exp(-3.5F * radius * radius - 2 * kPi * narrowness * angle * angle);
        }
      }
      filters.push_back(ForBothParts(filter));
    }
  }
  return filters;
}

Eigen::VectorXf Encode(const cv::Mat& grey) {
  static const std::vector<cv::Mat> filters = MakeFilters();
  cv::Mat image;
  cv::resize(grey, image, cv::Size(kSize, kSize), 0, 0, cv::INTER_AREA);
  image = NormaliseContrast(image);
  cv::copyMakeBorder(image, image, kFilterPadding, kFilterPadding, kFilterPadding, kFilterPadding,
                     cv::BORDER_REFLECT);
  const cv::Mat spectrum = Transform(image);
  Eigen::VectorXf gist(kGistDim);
  Eigen::Index entry = 0;
  for (const cv::Mat& filter : filters) {
    std::vector<cv::Mat> parts;
    cv::split(Filter(spectrum, filter), parts);
    cv::Mat magnitude;
    cv::magnitude(parts[0], parts[1], magnitude);
    constexpr int kCell = kSize / kNumCells;
    for (int y = 0; y < kNumCells; ++y) {
      for (int x = 0; x < kNumCells; ++x) {
        const cv::Rect cell(kFilterPadding + x * kCell, kFilterPadding + y * kCell, kCell, kCell);
        gist[entry++] = static_cast<float>(cv::mean(magnitude(cell))[0]);
      }
    }
  }
  // What is left of a photo of one colour is rounding.
  constexpr float kLeastLength = 1e-3F;
  const float length = gist.norm();
  if (length < kLeastLength) return Eigen::VectorXf::Zero(kGistDim);
  return gist / length;
}

}  // namespace

Eigen::VectorXf EncodeGistFile(const std::filesystem::path& directory, const std::string& name) {
  const std::string photo = "Cannot read the photo " + (directory / name).string() + ": ";
  cv::Mat grey;
  try {
    // COLMAP does not turn photos by their EXIF data either.
    grey = cv::imdecode(ReadPhoto(directory, name),
                        cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const UnreadableFileError& error) {
    throw FileError(photo + error.Reason() +
                    ". Is --image_path the directory that the names in the database start from?");
  } catch (const cv::Exception& error) {
    throw FileError(photo + error.what());
  }
  if (grey.empty()) {
    throw FileError(photo + "it is damaged, or of a kind that OpenCV does not know.");
  }
  return Encode(grey);
}

}  // namespace colmap_graphmatch
