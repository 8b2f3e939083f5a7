#include "colmap_graphmatch/graph/pair_restrictions.h"

#include <boost/crc.hpp>

namespace colmap_graphmatch {

std::string PairRestrictions::Key() const {
  const auto& [all_seeking, all_frames] = *this;  // Does not compile if a field is forgotten.
  boost::crc_32_type seeking_checksum;
  for (const bool seeks : all_seeking) seeking_checksum.process_byte(seeks ? 1 : 0);
  boost::crc_32_type frames_checksum;
  for (const std::uint32_t frame : all_frames) {
    frames_checksum.process_bytes(&frame, sizeof(frame));
  }
  return "seeking " + std::to_string(all_seeking.size()) + " " +
         std::to_string(seeking_checksum.checksum()) + ", frames " +
         std::to_string(all_frames.size()) + " " + std::to_string(frames_checksum.checksum());
}

}  // namespace colmap_graphmatch
