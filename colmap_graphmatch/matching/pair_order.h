#pragma once

#include <vector>

#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

// Sorts pairs so that those close to each other in the list share images: along a Z-order curve
// (Morton, 1966) through the plane of the two ids. It goes through squares of any size one after
// the other, so that a cache of any size serves it well; the order depends on the pairs alone.
void SortForReuse(std::vector<ImagePair>* pairs);

}  // namespace colmap_graphmatch
