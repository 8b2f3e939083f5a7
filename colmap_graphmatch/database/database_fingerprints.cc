#include <algorithm>
#include <boost/crc.hpp>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/database.h"

namespace colmap_graphmatch {

std::vector<ImageFingerprint> Database::ReadFingerprints(const std::vector<ImageRecord>& images) {
  // About what is on the pages of the rows themselves: the rest of a blob is elsewhere in the file.
  constexpr std::size_t kNumBytes = 2048;
  sqlite::BlobPrefixReader descriptors(connection_, "descriptors", "data");
  sqlite::BlobPrefixReader keypoints(connection_, "keypoints", "data");
  std::vector<ImageFingerprint> fingerprints;
  for (const ImageRecord& image : images) {
    if (image.num_features == 0) continue;
    boost::crc_32_type crc;
    for (sqlite::BlobPrefixReader* reader : {&descriptors, &keypoints}) {
      const sqlite::Blob bytes = reader->Read(image.id, kNumBytes);
      crc.process_bytes(bytes.data(), bytes.size());
    }
    fingerprints.push_back({image.id, static_cast<std::int64_t>(crc.checksum()) << 31 ^
                                          static_cast<std::int64_t>(image.num_features)});
  }
  return fingerprints;
}

void Database::ExpectFeatures(const std::vector<ImageRecord>& images,
                              const std::vector<ImageFingerprint>& fingerprints) {
  expected_.clear();
  for (const ImageFingerprint& fingerprint : fingerprints) {
    expected_[fingerprint.id].features = fingerprint.features;
  }
  for (const ImageRecord& image : images) {
    const auto expected = expected_.find(image.id);
    if (expected != expected_.end()) expected->second.image = image;
  }
}

bool Database::HasFeatures(const ImageRecord& image, std::int64_t features) {
  // Their number is part of the fingerprint: as it is now. Without blobs there is none.
  sqlite::Statement select(
      connection_,
      "SELECT descriptors.rows FROM descriptors JOIN keypoints USING(image_id) WHERE image_id = ?1 "
      "AND typeof(descriptors.data) = 'blob' AND typeof(keypoints.data) = 'blob'");
  if (!select.Bind(1, std::int64_t{image.id}).Step()) return false;
  ImageRecord now = image;
  now.num_features = static_cast<std::size_t>(std::max<std::int64_t>(0, select.Int(0)));
  const std::vector<ImageFingerprint> found = ReadFingerprints({now});
  return !found.empty() && found.front().features == features;
}

void Database::CheckFeatures(const std::vector<PairGeometry>& pairs) {
  if (expected_.empty()) return;
  const std::int64_t version = connection_.DataVersion();
  std::vector<ImageRecord> unseen;
  for (const PairGeometry& tested : pairs) {
    for (const ImageId id : {tested.pair.id1, tested.pair.id2}) {
      ExpectedFeatures& expected = expected_.at(id);
      if (expected.seen_in == version) continue;
      expected.seen_in = version;
      unseen.push_back(expected.image);
    }
  }
  for (const ImageRecord& image : unseen) {
    if (HasFeatures(image, expected_.at(image.id).features)) continue;
    throw DatabaseError("The features of image \"" + image.name + "\" (id " +
                        std::to_string(image.id) + ") in " + Path().string() +
                        " changed during the run. Pairs of its old features are not written. Let "
                        "the other program finish, then run the same command again.");
  }
}

}  // namespace colmap_graphmatch
