#include "colmap_graphmatch/files/ranked_lists.h"

#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>
#include <boost/crc.hpp>
#include <boost/lexical_cast/try_lexical_convert.hpp>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/files/text_file.h"

namespace colmap_graphmatch {

RankedLists ReadRankedLists(const std::filesystem::path& path,
                            const std::vector<ImageRecord>& images, const StopRequest* stop) {
  std::unordered_map<std::string, Vertex> vertices;
  for (const ImageRecord& image : images) {
    vertices.emplace(image.name, static_cast<Vertex>(vertices.size()));
  }
  RankedLists read;
  boost::crc_32_type crc;
  std::vector<std::vector<ScoredVertex>> lists(images.size());
  std::size_t num_read = 0;
  for (const Line& line : ReadLines(path, "ranked images",
                                    "an image, another one and a score, "
                                    "separated by tabs, a line",
                                    stop)) {
    crc.process_bytes(line.text.data(), line.text.size());
    std::vector<std::string> fields;
    boost::split(fields, line.text, boost::is_any_of("\t"));
    float score = 0;
    if (fields.size() != 3 || !boost::conversion::try_lexical_convert(fields[2], score) ||
        !std::isfinite(score)) {
      throw FileError("Line " + std::to_string(line.number) + " of " + path.string() +
                      " is not \"image<tab>other image<tab>score\": \"" + line.text + "\".");
    }
    const auto image = vertices.find(fields[0]);
    const auto other = vertices.find(fields[1]);
    if (image == vertices.end() || other == vertices.end()) {
      if (read.num_skipped++ == 0) read.first_skipped = line.text;
      continue;
    }
    lists[image->second].push_back({other->second, score});
    ++num_read;
  }
  if (num_read == 0) {
    throw FileError("No line of " + path.string() +
                    " names two images with features of this database; the first is \"" +
                    read.first_skipped + "\". Are these names as in the table `images`?");
  }
  read.ranking = std::make_unique<ListRanking>(std::move(lists));
  read.checksum = std::to_string(crc.checksum());
  return read;
}

}  // namespace colmap_graphmatch
