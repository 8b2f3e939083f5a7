#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/features.h"
#include "colmap_graphmatch/database/sqlite.h"

namespace colmap_graphmatch {

// What a run keeps beside the user's database for the next one: the model, the vectors and the
// seeds of the loop, in the file DATABASE.graphmatch (docs/formats.md). The file is held locked
// as long as the object lives, so that only one run works on a database at a time. Rows whose
// checksum is wrong are as if they were not there.
//
// Errors: DatabaseError, e.g. if the file cannot be written; sqlite::DamagedFileError if SQLite
// cannot read it any more: then MakeAnew helps. DatabaseLockedError if another run held it for
// longer than the given time.
class StateFile {
 public:
  // The file that belongs to a database. Links are followed: a database has one state.
  static std::filesystem::path PathFor(const std::filesystem::path& database_path);

  // Opens the file or makes it; one that is of another version, or cannot be opened any more, is
  // made anew. Throws DatabaseError if something else is in its place. Who may not read the
  // database may not read this file.
  StateFile(const std::filesystem::path& database_path, const sqlite::LockPatience& patience);

  const std::filesystem::path& Path() const { return path_; }

  // Empties it; the lock stays.
  void MakeAnew();

  // The mixture that was stored with the same key: what it depends on. Any bytes of the caller.
  std::optional<sqlite::Blob> ReadMixture(const std::string& key);
  // Drops all vectors: they belong to another mixture.
  void WriteMixture(const std::string& key, const sqlite::Blob& mixture);

  // Drops the vectors of images that are not among these, which ascend.
  void DropVectorsExcept(const std::vector<ImageFingerprint>& images);

  // The images that have a vector which was stored for other features.
  std::vector<ImageId> FindChanged(const std::vector<ImageFingerprint>& images);

  // How many of the images have a vector that was stored for the same features.
  std::size_t CountVectors(const std::vector<ImageFingerprint>& images);
  // Hands out the vectors of those images, by their places; true for each that was taken.
  using TakeVector = std::function<bool(std::size_t i, const std::uint8_t* data, std::size_t size)>;
  std::vector<bool> ReadVectors(const std::vector<ImageFingerprint>& images,
                                const TakeVector& take);
  // vector_of(i): the bytes of the vector of image i.
  void WriteVectors(const std::vector<ImageFingerprint>& images,
                    const std::function<sqlite::Blob(std::size_t i)>& vector_of);

  // The seeds that were stored with the same key, ascending.
  std::optional<std::vector<ImagePair>> ReadSeeds(const std::string& key);
  void WriteSeeds(const std::string& key, const std::vector<ImagePair>& seeds);

 private:
  static sqlite::Connection Open(const std::filesystem::path& path,
                                 const sqlite::LockPatience& patience);

  std::filesystem::path path_;
  sqlite::Connection connection_;
};

}  // namespace colmap_graphmatch
