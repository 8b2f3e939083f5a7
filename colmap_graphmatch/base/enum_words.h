#pragma once

#include <array>
#include <cstddef>

namespace colmap_graphmatch {

// What users and reports call a value of an enum. The words of all its values stand beside it.
template <typename Enum>
struct EnumWord {
  Enum value;
  const char* word;
};

template <typename Enum, std::size_t N>
using EnumWords = std::array<EnumWord<Enum>, N>;

template <typename Enum, std::size_t N>
constexpr const char* WordOf(const EnumWords<Enum, N>& words, Enum value) {
  for (const EnumWord<Enum>& entry : words) {
    if (entry.value == value) return entry.word;
  }
  return "";
}

}  // namespace colmap_graphmatch
