#pragma once

namespace colmap_graphmatch {

// Beside Highway's targets, AVX2 and NEON have instructions for dot products of bytes on newer
// processors, which are used where they exist. For tests and benchmarks of the code without them.
void AllowDotProductsForTest(bool allowed);

}  // namespace colmap_graphmatch
