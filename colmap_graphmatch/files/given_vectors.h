#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "colmap_graphmatch/database/database.h"

namespace colmap_graphmatch {

// Vectors that another program made, of any learned descriptor, say.
struct GivenVectors {
  std::vector<ImageRecord> images;  // Those that have one, in their order,
  std::size_t dim = 0;
  std::vector<float> rows;      // and a row of dim floats for each, of unit length.
  std::string checksum;         // Of images and rows.
  std::size_t num_skipped = 0;  // Rows of images that are not among the given ones.
  std::string first_skipped;
};

// Reads a NumPy array with the list of names beside it (encoding/numpy_file.h). images: those with
// features. A vector that is zero stays zero. Throws FileError.
GivenVectors ReadGivenVectors(const std::filesystem::path& path,
                              const std::vector<ImageRecord>& images);

}  // namespace colmap_graphmatch
