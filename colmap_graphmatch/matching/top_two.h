#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace colmap_graphmatch {

// num x 128 descriptors of one image, row-major. Not owned.
struct DescriptorView {
  const std::uint8_t* data = nullptr;
  std::size_t num = 0;
};

// The greatest and the second greatest dot product of every descriptor a with the descriptors b,
// and of every b with the a. 0 stands for "none", as in COLMAP: descriptors that are orthogonal to
// all others have no best. If several are the greatest, they are the best and the second best.
struct TopTwo {
  // By descriptor of a. best_b: which one is the best; the first of several; 0 if there is none.
  std::vector<std::int32_t> best_of_a;
  std::vector<std::int32_t> second_of_a;
  std::vector<std::uint32_t> best_b;

  // By descriptor of b.
  std::vector<std::int32_t> best_of_b;
  std::vector<std::int32_t> second_of_b;
};

// Memory that calls of ComputeTopTwo leave for the next one.
struct TopTwoBuffers {
  std::vector<std::uint32_t> packed_b;
  std::vector<std::uint32_t> packed_a;
  std::vector<std::int32_t> row_keys;
  std::vector<std::int32_t> column_keys;
};

// All products in one pass, exact, without a matrix of them: memory is proportional to the number
// of descriptors. Every instruction set gives the same result. Either side may be empty.
void ComputeTopTwo(const DescriptorView& a, const DescriptorView& b, TopTwoBuffers* buffers,
                   TopTwo* result);

// The instruction set that ComputeTopTwo uses on this machine.
const char* TopTwoTarget();

}  // namespace colmap_graphmatch
