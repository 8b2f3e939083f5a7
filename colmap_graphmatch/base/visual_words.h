#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace colmap_graphmatch {

// The signs of 128 numbers: bit d % 64 of entry d / 64 is set where number d is positive.
using Signs = std::array<std::uint64_t, 2>;

// An image as a bag of visual words (Tolias, Avrithis and Jegou, ICCV 2013): the words that its
// features belong to, ascending and each once, and for each the signs of the sum of its features'
// residuals.
struct VisualWords {
  std::vector<std::uint32_t> words;
  std::vector<Signs> signs;  // As many as words.
};

}  // namespace colmap_graphmatch
