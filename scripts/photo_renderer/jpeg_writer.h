#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace colmap_graphmatch::synthetic {

// Writes rows of RGB bytes. Throws std::runtime_error if the file cannot be written.
void WriteJpeg(const std::string& path, int width, int height, int quality,
               const std::vector<uint8_t>& rgb);

}  // namespace colmap_graphmatch::synthetic
