#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "colmap_graphmatch/base/camera.h"
#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/base/position_prior.h"
#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/features.h"
#include "colmap_graphmatch/database/sqlite.h"
#include "colmap_graphmatch/database/two_view_geometry_codec.h"

namespace colmap_graphmatch {

// Those of the images that have features.
std::vector<ImageRecord> WithFeatures(const std::vector<ImageRecord>& images);

// A row of `two_view_geometries` as far as the matching graph needs it.
struct TestedPair {
  ImagePair pair;
  std::size_t num_inliers = 0;
  int config = 0;
};

// The matches of a pair are not as COLMAP writes them.
class DamagedMatchesError : public DatabaseError {
 public:
  using DatabaseError::DatabaseError;
};

// The database of a user, made by any COLMAP from 3.8 on. Opening checks that it is one. Nothing in
// it is changed but by WritePairs. Not thread-safe: every thread opens its own.
//
// Errors: DatabaseError, DatabaseLockedError (see sqlite.h); the message names the file and, where
// one is at fault, the image.
class Database {
 public:
  // patience: with the locks of other processes.
  Database(const std::filesystem::path& path, sqlite::Access access,
           const sqlite::LockPatience& patience);

  const std::filesystem::path& Path() const { return connection_.Path(); }

  // All images, by ascending id. Throws if there is none, if none has features, or if the features
  // of any image are not SIFT descriptors of 128 bytes with as many keypoints.
  std::vector<ImageRecord> ReadImages();

  // The features of one image; no rows if it has none.
  Descriptors ReadDescriptors(ImageId image_id);

  Keypoints ReadKeypoints(ImageId image_id);

  // Throw if there are not as many as when the images were listed.
  Descriptors ReadDescriptors(const ImageRecord& image);
  Keypoints ReadKeypoints(const ImageRecord& image);

  // What tells whether the features of an image are still the same: their number and the beginnings
  // of their descriptors and keypoints. Images without features are left out.
  std::vector<ImageFingerprint> ReadFingerprints(const std::vector<ImageRecord>& images);

  // From now on WritePairs throws if an image of a pair, which must be among these, has other
  // features: what is to be written was computed from those that it had. images and fingerprints:
  // as read before.
  void ExpectFeatures(const std::vector<ImageRecord>& images,
                      const std::vector<ImageFingerprint>& fingerprints);

  // Every camera, as it is.
  std::map<CameraId, Camera> ReadCameras();

  // The frame of every image that has one (COLMAP 3.12 and later): what the cameras of a rig took
  // at the same time.
  std::map<ImageId, std::uint32_t> ReadFrames();

  // Where images were taken, of those of which it is known: GPS, or what a user has written. Of
  // COLMAP before 3.10, which does not say what they are, the numbers are taken for GPS if most
  // can be.
  std::map<ImageId, PositionPrior> ReadPositions();

  // The pairs that have a row in `two_view_geometries`, ascending; keys that stand for no pair are
  // left out. (COLMAP's matchers also ask for
  // a row in `matches` before they skip a pair; what is verified is never verified again here.)
  std::vector<TestedPair> ReadTestedPairs();
  // The same, judged by IsEdge.
  std::vector<VerifiedPair> ReadVerifiedPairs(std::size_t min_num_inliers);

  // The matches of a pair, and the inlier matches of a tested one; none if there is no such row.
  // Throw DamagedMatchesError if they cannot be.
  FeatureMatches ReadMatches(const ImagePair& pair);
  FeatureMatches ReadInliers(const ImagePair& pair);

  // The number of matches of every pair that has a row in `matches`.
  std::unordered_map<ImagePair, std::size_t> ReadNumMatches();

  // The pairs that have matches, made elsewhere, and no two-view geometry yet, ascending.
  std::vector<ImagePair> ReadUnverifiedPairs();

  // What COLMAPs that made databases like this one store for a pair with too few matches.
  TwoViewConfiguration ConfigurationOfUnmatched() const { return unmatched_; }

  // Takes the write lock for a moment: that the database cannot be written should not be learnt
  // late.
  void CheckWritable();

  // Throws if there is another file at the path by now, or none: what was written since is in a
  // file that is gone.
  void CheckInPlace();

  // Adds pairs in one transaction: after an error nothing of them is in the database. The first
  // call goes through all pages of both tables, and throws if they are damaged. A pair that
  // another program has tested in the meantime is left as that program wrote it; returns those, as
  // they are in the database. Matrices are
  // stored the way the COLMAP that made this database marks unset ones.
  std::vector<TestedPair> WritePairs(const std::vector<PairGeometry>& pairs);

 private:
  void CheckSchema();
  std::map<ImageId, PositionPrior> ReadPosePriors(const std::vector<std::string>& columns);
  std::map<ImageId, PositionPrior> ReadPositionsOfImages();
  FeatureMatches ReadMatchesFrom(const std::string& table, const ImagePair& pair);
  // Throws if these are not all features of the image.
  void CheckNumber(std::size_t num_rows, const ImageRecord& image) const;
  // Whether the features of an image have this fingerprint.
  bool HasFeatures(const ImageRecord& image, std::int64_t features);
  void CheckFeatures(const std::vector<PairGeometry>& pairs);
  [[noreturn]] void ThrowNotColmaps(const std::string& problem) const;
  // What `problem` says of the file is only possible if it is damaged.
  [[noreturn]] void ThrowDamaged(const std::string& problem) const;

  sqlite::Connection connection_;
  TwoViewGeometryCodec codec_{{}, false};
  bool cameras_have_prior_ = false;
  TwoViewConfiguration unmatched_ = TwoViewConfiguration::kUndefined;
  bool descriptors_have_type_ = false;
  bool pages_are_checked_ = false;

  // What ExpectFeatures was told of an image.
  struct ExpectedFeatures {
    ImageRecord image;
    std::int64_t features = 0;
    std::int64_t seen_in = 0;  // The version of the data in which they were found unchanged.
  };
  std::unordered_map<ImageId, ExpectedFeatures> expected_;
};

}  // namespace colmap_graphmatch
