#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/database.h"

namespace colmap_graphmatch {

// A shard is a small COLMAP database, made by the installed COLMAP, that contains just what that
// COLMAP needs to match and verify one batch of pairs. See docs/design.md.

// The name that an image has in shards: its id. COLMAP's lists of pairs break on spaces in names.
std::string ShardImageName(ImageId image_id);

// Copies the cameras, images, keypoints and descriptors of the pairs' images from the user's
// database into the empty shard, and the rows of `matches` of those pairs that have some: matches
// that were made elsewhere and await verification. Ids stay the same. Throws DatabaseError.
void FillShard(const std::filesystem::path& shard_path, const std::filesystem::path& database_path,
               double lock_timeout_seconds, const std::vector<ImagePair>& pairs);

// What COLMAP wrote into the shard for the pairs. Throws DatabaseError if a pair has no result, or
// one that cannot be: wrong sizes, features that the images do not have (num_features, by image),
// unknown configurations.
std::vector<PairRows> ReadShard(const std::filesystem::path& shard_path,
                                const std::vector<ImagePair>& pairs,
                                const std::map<ImageId, std::size_t>& num_features);

}  // namespace colmap_graphmatch
