#pragma once

#include <cstddef>
#include <cstdint>

#include "colmap_graphmatch/base/visual_words.h"

namespace colmap_graphmatch {

// distances[i] = the number of bits (0 to 128) in which signs i, whose two words are low[i] and
// high[i], differ from the query. Uses the widest vector instructions of the processor it runs on.
void HammingDistances(const Signs& query, const std::uint64_t* low, const std::uint64_t* high,
                      std::size_t num, std::uint64_t* distances);

}  // namespace colmap_graphmatch
