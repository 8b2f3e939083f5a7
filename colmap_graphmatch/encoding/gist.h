#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <string>

namespace colmap_graphmatch {

// 4 scales x 8 orientations x 4 x 4 cells, grey.
inline constexpr std::size_t kGistDim = 512;

// Describes a photo as a whole by GIST (Oliva and Torralba, Modeling the shape of the scene, IJCV
// 2001), with the filters and constants of the authors' program: the photo in grey, scaled to 256 x
// 256 pixels, its local contrast normalised; then the mean magnitudes of Gabor filters over the
// cells, all cells of a filter (row by row) after each other, filters by scale and then
// orientation; scaled to unit length. All zero for a photo of one colour. Thread-safe.
//
// directory, name: see ReadPhoto. Throws FileError if the photo cannot be read.
Eigen::VectorXf EncodeGistFile(const std::filesystem::path& directory, const std::string& name);

}  // namespace colmap_graphmatch
