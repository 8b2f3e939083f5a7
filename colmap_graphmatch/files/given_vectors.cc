#include "colmap_graphmatch/files/given_vectors.h"

#include <algorithm>
#include <boost/crc.hpp>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/encoding/numpy_file.h"

namespace colmap_graphmatch {

GivenVectors ReadGivenVectors(const std::filesystem::path& path,
                              const std::vector<ImageRecord>& images) {
  const NamedVectors named = ReadNamedVectors(path);
  std::unordered_map<std::string, std::size_t> row_of;
  for (std::size_t row = 0; row < named.names.size(); ++row) row_of[named.names[row]] = row;
  GivenVectors given;
  given.dim = named.dim;
  boost::crc_32_type crc;
  given.rows.reserve(named.rows.size());
  std::vector<bool> used(named.names.size());
  for (const ImageRecord& image : images) {
    const auto found = row_of.find(image.name);
    if (found == row_of.end()) continue;
    used[found->second] = true;
    const float* row = named.rows.data() + found->second * named.dim;
    double squares = 0;
    for (std::size_t i = 0; i < named.dim; ++i) squares += double{row[i]} * double{row[i]};
    // One without a direction stays as it is: as near to every other as unlike photos are.
    const double scale = squares > 0 ? 1 / std::sqrt(squares) : 1;
    for (std::size_t i = 0; i < named.dim; ++i) {
      given.rows.push_back(static_cast<float>(row[i] * scale));
    }
    given.images.push_back(image);
    crc.process_bytes(&image.id, sizeof(image.id));
  }
  for (std::size_t row = 0; row < used.size(); ++row) {
    if (!used[row] && given.num_skipped++ == 0) given.first_skipped = named.names[row];
  }
  if (given.images.empty()) {
    throw FileError("No row of " + path.string() +
                    " is of an image with features of this database; the first is of \"" +
                    given.first_skipped + "\". Are these names as in the table `images`?");
  }
  crc.process_bytes(&given.dim, sizeof(given.dim));
  crc.process_bytes(given.rows.data(), given.rows.size() * sizeof(float));
  given.checksum = std::to_string(crc.checksum());
  return given;
}

}  // namespace colmap_graphmatch
