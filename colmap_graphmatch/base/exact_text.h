#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace colmap_graphmatch {

// A number to its last bit, for keys: equal for equal numbers alone.
inline std::string ExactText(double value) {
  std::array<char, 32> text = {};
  std::snprintf(text.data(), text.size(), "%a", value);
  return text.data();
}

}  // namespace colmap_graphmatch
