#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/shard_features.h"
#include "colmap_graphmatch/verification/colmap_installation.h"
#include "colmap_graphmatch/verification/geometry_verifier.h"
#include "colmap_graphmatch/verification/options.h"
#include "colmap_graphmatch/verification/plan.h"

namespace colmap_graphmatch {

// COLMAP's geometric verification: every shard is a small database of its own (database/shard.h)
// and one process, `colmap matches_importer`. Where COLMAP matches too, the shard has descriptors.
class ColmapVerifier : public GeometryVerifier {
 public:
  struct Statistics {
    double seconds = 0;            // In which COLMAP ran, summed over processes.
    std::size_t num_verified = 0;  // Pairs.
  };

  // database_path: the user's, which shards are filled from. images: those of it. work_path: an
  // existing directory for the shards. stop must outlive the verifier. on_warning is called by the
  // constructor alone. Throws ColmapError if COLMAP cannot make an empty database, OptionsError if
  // it lacks an option that may not be left out.
  ColmapVerifier(const VerificationOptions& options, const VerificationPlan& plan,
                 const ColmapInstallation& colmap, const std::filesystem::path& database_path,
                 const std::vector<ImageRecord>& images, const std::filesystem::path& work_path,
                 const StopRequest& stop,
                 const std::function<void(const std::string&)>& on_warning);

  ShardOutcome Verify(const std::vector<PairToVerify>& pairs,
                      const std::function<bool()>& should_stop) override {
    return Verify(pairs, Trials::kAsAsked, should_stop);
  }

  // kForHalfInliers: as many as matches take of which half or more are inliers.
  enum class Trials { kAsAsked, kForHalfInliers };
  ShardOutcome Verify(const std::vector<PairToVerify>& pairs, Trials trials,
                      const std::function<bool()>& should_stop);
  TwoViewConfiguration ConfigurationOfUnmatched() const override;
  std::string AdviceOnFailure() const override;

  // Of all calls of Verify so far.
  Statistics SoFar() const;

 private:
  std::vector<std::string> FindArguments(
      const std::function<void(const std::string&)>& on_warning) const;
  std::vector<std::string> ArgumentsForHalfInliers() const;
  void MakeTemplate() const;
  // In this directory, with a list of its pairs.
  ShardFeatures MakeShard(const std::filesystem::path& directory,
                          const std::vector<PairToVerify>& pairs) const;
  // What verifies the shard in this directory.
  std::vector<std::string> Command(const std::filesystem::path& directory, Trials trials) const;
  double Timeout(std::size_t num_pairs, Trials trials) const;
  std::map<ImageId, std::size_t> NumFeatures(const std::vector<PairToVerify>& pairs) const;

  VerificationOptions options_;
  VerificationPlan plan_;
  ColmapInstallation colmap_;
  std::filesystem::path database_path_;
  std::map<ImageId, std::size_t> num_features_;  // Of each image.
  std::filesystem::path work_path_;
  std::filesystem::path template_path_;  // An empty database, made by the installed COLMAP.
  const StopRequest& stop_;
  bool shards_have_descriptors_ = true;
  std::vector<std::string> arguments_;  // Of every run of matches_importer.
  std::vector<std::string> arguments_for_half_;

  mutable std::mutex mutex_;  // Of what follows.
  Statistics statistics_;
  std::array<double, 2> slowest_seconds_per_pair_ = {};  // By Trials; 0 until a shard came back.
};

}  // namespace colmap_graphmatch
