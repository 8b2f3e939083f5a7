#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "colmap_graphmatch/database/features.h"
#include "colmap_graphmatch/database/sqlite.h"

namespace colmap_graphmatch {

// The schemas of COLMAP's databases, as its versions create them.
enum class Schema { kColmap38, kColmap310, kColmap42 };

struct SyntheticImage {
  std::string name;
  Descriptors descriptors;
  // One row a descriptor; 4 columns unless set otherwise. Made up if empty.
  Keypoints keypoints;
};

// Makes the tables of a version of COLMAP in a new file and returns the open database.
sqlite::Connection CreateColmapDatabase(const std::filesystem::path& path, Schema schema);

// CreateColmapDatabase filled with one camera and the images, ids from 1.
void WriteSyntheticDatabase(const std::filesystem::path& path, Schema schema,
                            const std::vector<SyntheticImage>& images);

// num_images images of several places, `photos_a_place` each in a row: the descriptors of a place
// are noisy copies of its own, so that the images of a place look alike.
std::vector<SyntheticImage> MakePlaces(int num_places, int photos_a_place, int num_features,
                                       std::uint64_t seed);

// A new directory for one test, removed with the object.
class TestDirectory {
 public:
  TestDirectory();
  ~TestDirectory();
  TestDirectory(const TestDirectory&) = delete;
  TestDirectory& operator=(const TestDirectory&) = delete;
  const std::filesystem::path& Path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace colmap_graphmatch
