#include "colmap_graphmatch/matching/descriptor_matcher.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {
namespace {

// COLMAP's kSqSiftDescriptorNorm.
constexpr float kInverseSquaredNorm = 1.0F / (512.0F * 512.0F);

float Angle(std::int32_t product) {
  return std::acos(std::min(kInverseSquaredNorm * static_cast<float>(product), 1.0F));
}

// Whether no row of image1 before `row` has the same product with the column.
bool IsFirstWithProduct(const DescriptorView& image1, std::size_t row, const std::uint8_t* column,
                        std::int32_t product) {
  for (std::size_t i = 0; i < row; ++i) {
    const std::uint8_t* entries = image1.data + i * kDescriptorDim;
    if (std::inner_product(entries, entries + kDescriptorDim, column, 0) == product) return false;
  }
  return true;
}

}  // namespace

void DescriptorMatchingOptions::Check() const {
  if (!(max_ratio > 0)) throw OptionsError("max_ratio must be greater than 0.");
  if (!(max_distance > 0)) throw OptionsError("max_distance must be greater than 0.");
  if (max_num_matches < 1) throw OptionsError("max_num_matches must be at least 1.");
}

DescriptorMatcher::DescriptorMatcher(const DescriptorMatchingOptions& options)
    : options_(options),
      max_ratio_(static_cast<float>(options.max_ratio)),
      max_distance_(static_cast<float>(options.max_distance)) {
  options_.Check();
  // 2^-12 off, far more than acos may err by.
  const double cosine = max_distance_ < 3 ? std::cos(max_distance_ + 0x1p-12) : -1.0;
  min_product_ = std::max(1, static_cast<std::int32_t>(cosine / kInverseSquaredNorm));
}

bool DescriptorMatcher::Passes(std::int32_t best, std::int32_t second) const {
  if (best < min_product_) return false;
  const float angle = Angle(best);
  return angle <= max_distance_ && angle < max_ratio_ * Angle(second);
}

FeatureMatches DescriptorMatcher::Match(const DescriptorView& image1, const DescriptorView& image2,
                                        std::vector<float>* distinctness) {
  const auto limit = static_cast<std::size_t>(options_.max_num_matches);
  const DescriptorView a{image1.data, std::min(image1.num, limit)};
  const DescriptorView b{image2.data, std::min(image2.num, limit)};
  ComputeTopTwo(a, b, &buffers_, &top_two_);

  FeatureMatches matches;
  if (distinctness != nullptr) distinctness->clear();
  for (std::size_t i = 0; i < a.num; ++i) {
    const std::int32_t best = top_two_.best_of_a[i];
    if (!Passes(best, top_two_.second_of_a[i])) continue;
    const std::size_t j = top_two_.best_b[i];
    if (options_.cross_check) {
      if (best != top_two_.best_of_b[j] || !Passes(best, top_two_.second_of_b[j])) continue;
      // Only a max_ratio above 1 lets two that are equally near pass.
      if (best == top_two_.second_of_b[j] &&
          !IsFirstWithProduct(a, i, b.data + j * kDescriptorDim, best)) {
        continue;
      }
    }
    matches.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
    if (distinctness != nullptr) {
      distinctness->push_back(1 - Angle(best) / Angle(top_two_.second_of_a[i]));
    }
  }
  return matches;
}

}  // namespace colmap_graphmatch
