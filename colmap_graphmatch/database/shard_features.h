#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/sqlite.h"

namespace colmap_graphmatch {

struct ShardPair {
  ImagePair pair;

  // For COLMAP to verify; none: COLMAP matches the pair itself.
  std::optional<FeatureMatches> matches;
};

// Which features of its images a shard has, by image: their numbers in the user's database,
// ascending. In the shard they are numbered from 0 in this order. Images that are not listed have
// all of their features.
using ShardFeatures = std::map<ImageId, std::vector<std::uint32_t>>;

// The features that the matches name; all pairs must have some.
ShardFeatures FeaturesOf(const std::vector<ShardPair>& pairs);

// Copies the keypoints of these features from the attached database "source". Of an image whose
// keypoints cannot be, COLMAP gets the row as it is, and says what it thinks of it; the image is
// taken out of the list.
void CopyKeypoints(sqlite::Connection& shard, ShardFeatures* features);

// From the numbers of the user's database to those of the shard, and back.
FeatureMatches ToShard(const ImagePair& pair, FeatureMatches matches,
                       const ShardFeatures& features);
FeatureMatches FromShard(const ImagePair& pair, FeatureMatches matches,
                         const ShardFeatures& features);

}  // namespace colmap_graphmatch
