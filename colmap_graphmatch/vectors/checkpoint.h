#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/messages.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/base/visual_words.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/database/state_file.h"
#include "colmap_graphmatch/vectors/options.h"
#include "colmap_graphmatch/vectors/vector_model.h"

namespace colmap_graphmatch {

// What this run keeps for the next one in the state file of the database (database/state_file.h),
// and what it finds there: the model, the vectors, the seeds of the loop. A file that cannot be
// written costs a warning: the run goes on without.
class Checkpoint {
 public:
  // Keeps nothing and finds nothing.
  Checkpoint() = default;

  // Waits for another run on the same database. Throws DatabaseLockedError if it is still at work
  // then; StoppedError if stop asks for it.
  Checkpoint(const std::filesystem::path& database_path, const sqlite::LockPatience& patience,
             const Messages& messages);

  // Chooses what is kept: vectors of these images under these options and this seed.
  // photos_checksum: of the files, for GIST.
  void Select(const ImageVectorOptions& options, std::uint64_t seed,
              std::vector<ImageFingerprint> images, const std::string& photos_checksum);

  // The same for a ranking that was given from outside and described by `ranking_key`: nothing but
  // the seeds is kept, and what is there of vectors stays.
  void SelectGiven(const std::string& ranking_key, std::vector<ImageFingerprint> images);

  // The selected images whose features are not those of the last run.
  std::vector<ImageId> FindChanged();

  // What an earlier run learnt, if at least half of the images have a vector under it. With more
  // new images than that it is worth learning anew.
  std::optional<VectorModel> ReadModel();
  void KeepModel(const VectorModel& model);

  // Fills the rows (dim floats) of the images that have a vector; true for each of them.
  std::vector<bool> ReadVectors(std::size_t dim, float* vectors);
  // vectors: a row for each of these images, given by their places among the selected ones.
  void KeepVectors(const std::vector<std::size_t>& which, std::size_t dim, const float* vectors);

  // The same for visual words, all below num_words. words: as many as the selected images.
  std::vector<bool> ReadWords(std::size_t num_words, std::vector<VisualWords>* words);
  // words: of each of these images.
  void KeepWords(const std::vector<std::size_t>& which, const std::vector<VisualWords>& words);

  // The seeds of the loop under the same images, model and loop_key; none if there are no such.
  std::vector<ImagePair> ReadSeeds(const std::string& loop_key);
  void KeepSeeds(const std::string& loop_key, const std::vector<ImagePair>& seeds);

 private:
  // Runs it, if there is a file, which is made anew if it is damaged. Other errors end its use.
  void Try(const std::function<void()>& action);
  void Keep(const std::vector<std::size_t>& which,
            const std::function<sqlite::Blob(std::size_t i)>& vector_of);
  std::string SeedsKey(const std::string& loop_key) const;

  Messages messages_;
  std::unique_ptr<StateFile> file_;
  bool usable_ = false;
  VectorModelShape shape_;
  std::string vectors_key_;
  std::string model_checksum_;
  std::vector<ImageFingerprint> images_;
  bool dropped_others_ = false;  // The vectors of images that are not selected.
  std::optional<std::vector<ImagePair>> kept_seeds_;
};

}  // namespace colmap_graphmatch
