#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace colmap_graphmatch {

// Vectors of images by their names.
struct NamedVectors {
  std::vector<std::string> names;
  std::size_t dim = 0;
  std::vector<float> rows;  // names.size() x dim, row-major.
};

// Where the names are: the extension is .txt instead.
std::filesystem::path NamesPath(std::filesystem::path path);

// Reads a two-dimensional NumPy array (format versions 1 to 3, little-endian float32 or float64, C
// order) and the names of its rows, one a line, at NamesPath. Throws
// FileError: a file cannot be read or is something else, a number is not finite, names are repeated
// or are not as many as rows.
NamedVectors ReadNamedVectors(const std::filesystem::path& path);

// Writes both files (version 1, float32), the array first, each under another name first, so that
// none is ever half written. Throws FileError.
void WriteNamedVectors(const std::filesystem::path& path, const NamedVectors& vectors);

}  // namespace colmap_graphmatch
