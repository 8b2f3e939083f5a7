#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/database/shard_features.h"

namespace colmap_graphmatch {

// A shard is a small COLMAP database, made by the installed COLMAP, that contains just what that
// COLMAP needs to match and verify one batch of pairs. See docs/design.md.

// The name that an image has in shards: its id. COLMAP's lists of pairs break on spaces in names.
std::string ShardImageName(ImageId image_id);

// Copies the cameras, images and keypoints of the pairs' images from the user's database into the
// empty shard, their descriptors if COLMAP is to match, and the rows of `matches` of those pairs
// that have some: matches that were made elsewhere and await verification. Adds the matches of the
// pairs. Ids stay the same. If all pairs bring their matches, only the features in these are
// copied: the others would be most of what COLMAP reads. Throws DatabaseError, also if a pair has
// neither descriptors nor matches, and if the user's database has matches for it that cannot be: a
// blob of the wrong size, features that the images do not have.
ShardFeatures FillShard(const std::filesystem::path& shard_path,
                        const std::filesystem::path& database_path,
                        const sqlite::LockPatience& patience, const std::vector<ShardPair>& pairs,
                        bool with_descriptors);

// What COLMAP wrote into the shard for the pairs, with the numbers that features have in the user's
// database. num_features: of every image there. Throws DatabaseError if a pair has no result, or
// one that cannot be: wrong sizes, features that the shard does not have, unknown configurations.
std::vector<PairGeometry> ReadShard(const std::filesystem::path& shard_path,
                                    const std::vector<ImagePair>& pairs,
                                    const std::map<ImageId, std::size_t>& num_features,
                                    const ShardFeatures& features);

}  // namespace colmap_graphmatch
