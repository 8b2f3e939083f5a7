#pragma once

#include <cstddef>
#include <cstdint>

namespace colmap_graphmatch {

// The number of bits that are set in both of two arrays of num words. Uses the widest vector
// instructions of the processor it runs on.
std::size_t CountCommonBits(const std::uint64_t* a, const std::uint64_t* b, std::size_t num);

}  // namespace colmap_graphmatch
