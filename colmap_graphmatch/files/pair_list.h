#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/database.h"

namespace colmap_graphmatch {

struct PairList {
  std::vector<ImagePair> pairs;  // As listed; a pair may be there twice.

  // Lines that name an image that the database does not have, or has no features of, or the same
  // image twice.
  std::size_t num_skipped = 0;
  std::string first_skipped;
};

// Reads a list of image pairs as COLMAP's matches_importer takes it: two names a line, with a space
// (or a tab) between them, and anything, like a score, after them; empty lines and those that begin
// with # are comments. Names may contain spaces (there, COLMAP fails) as long as only one way to
// cut the line gives two images. Throws FileError if the file cannot be read, if a line can be cut
// in several ways, or if none of its lines names a pair.
PairList ReadPairList(const std::filesystem::path& path, const std::vector<ImageRecord>& images,
                      const StopRequest* stop = nullptr);

struct ImageList {
  std::vector<ImageId> images;  // Ascending, each once.

  // Lines that name no image of the database with features.
  std::size_t num_skipped = 0;
  std::string first_skipped;
};

// Reads a list of images as vocab_tree_matcher takes it (VocabTreeMatching.match_list_path): a name
// a line; empty lines and those that begin with # are comments. Throws FileError if the file cannot
// be read, or if none of its lines names an image.
ImageList ReadImageList(const std::filesystem::path& path, const std::vector<ImageRecord>& images,
                        const StopRequest* stop = nullptr);

}  // namespace colmap_graphmatch
