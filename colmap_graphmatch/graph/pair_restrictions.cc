#include "colmap_graphmatch/graph/pair_restrictions.h"

#include <boost/crc.hpp>

namespace colmap_graphmatch {

std::string PairRestrictions::Key() const {
  const auto& [all_queries, all_frames] = *this;  // Does not compile if a field is forgotten.
  boost::crc_32_type queries_checksum;
  for (const bool is_query : all_queries) queries_checksum.process_byte(is_query ? 1 : 0);
  boost::crc_32_type frames_checksum;
  for (const std::uint32_t frame : all_frames) {
    frames_checksum.process_bytes(&frame, sizeof(frame));
  }
  // "seeking": the word in the state files that there are.
  return "seeking " + std::to_string(all_queries.size()) + " " +
         std::to_string(queries_checksum.checksum()) + ", frames " +
         std::to_string(all_frames.size()) + " " + std::to_string(frames_checksum.checksum());
}

}  // namespace colmap_graphmatch
