#include "colmap_graphmatch/verification/colmap_verifier.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/shard.h"
#include "colmap_graphmatch/verification/colmap_arguments.h"
#include "colmap_graphmatch/verification/subprocess.h"
#include "colmap_graphmatch/verification/work_directory.h"

namespace colmap_graphmatch {
namespace {

// How much slower than the slowest shard so far a shard may be, and the seconds that any may take.
constexpr double kPatience = 20;
constexpr double kMinTimeoutSeconds = 30;

// Of COLMAP's output, what is told when it fails.
constexpr std::size_t kNumLastLines = 8;

// What COLMAP 3.13 and later match with; not for others to leave out silently.
constexpr char kMatcherType[] = "FeatureMatching.type";

// The first COLMAP that is known to store pairs with too few matches as degenerate instead of
// undefined.
constexpr std::pair<int, int> kFirstDegenerate(4, 2);

// In the directory of a shard.
std::filesystem::path ShardPath(const std::filesystem::path& directory) {
  return directory / "database.db";
}
std::filesystem::path ListPath(const std::filesystem::path& directory) {
  return directory / "pairs.txt";
}

}  // namespace

ColmapVerifier::ColmapVerifier(const VerificationOptions& options, const VerificationPlan& plan,
                               const ColmapInstallation& colmap,
                               const std::filesystem::path& database_path,
                               const std::vector<ImageRecord>& images,
                               const std::filesystem::path& work_path, const StopRequest& stop,
                               const std::function<void(const std::string&)>& on_warning)
    : options_(options),
      plan_(plan),
      colmap_(colmap),
      database_path_(database_path),
      work_path_(work_path),
      template_path_(work_path / "template.db"),
      stop_(stop) {
  for (const ImageRecord& image : images) num_features_.emplace(image.id, image.num_features);
  // Guided matching is COLMAP's: it matches once more where the geometry says so.
  shards_have_descriptors_ =
      !plan_.matches_here || options.geometry.guided_matching.value_or(false);
  arguments_ = FindArguments(on_warning);
  arguments_for_half_ = ArgumentsForHalfInliers();
  MakeTemplate();
}

std::vector<std::string> ColmapVerifier::FindArguments(
    const std::function<void(const std::string&)>& on_warning) const {
  std::vector<std::string> unknown;
  std::vector<std::string> arguments = colmap_.Arguments(ColmapOptions(options_, plan_), &unknown);
  if (std::find(unknown.begin(), unknown.end(), kMatcherType) != unknown.end()) {
    throw OptionsError("COLMAP " + colmap_.Version() + " does not have --" + kMatcherType + " " +
                       options_.colmap_options.at(kMatcherType) +
                       ": it matches SIFT features in one way only. Leave the option out, or name "
                       "another COLMAP with --colmap_path.");
  }
  if (!unknown.empty()) {
    std::string names;
    for (const std::string& name : unknown) names += (names.empty() ? "" : ", ") + name;
    on_warning("COLMAP " + colmap_.Version() +
               " does not have these options, which have no effect: " + names + ".");
  }
  return arguments;
}

std::vector<std::string> ColmapVerifier::ArgumentsForHalfInliers() const {
  VerificationOptions options = options_;
  GeometryOptions& geometry = options.geometry;
  // As many as it takes by COLMAP's confidence to draw seven inliers once.
  constexpr int kMaxNumTrials = 2643;
  geometry.max_num_trials =
      std::min(kMaxNumTrials, geometry.max_num_trials.value_or(kMaxNumTrials));
  if (!colmap_.RejectsByInlierRatio()) geometry.min_inlier_ratio = 0.5;
  std::vector<std::string> unknown;  // They were warned of.
  return colmap_.Arguments(ColmapOptions(options, plan_), &unknown);
}

void ColmapVerifier::MakeTemplate() const {
  const std::filesystem::path output_path = work_path_ / "database_creator.txt";
  const std::string executable = colmap_.executable.string();
  const SubprocessResult result =
      RunTwice({executable, "database_creator", "--database_path", template_path_.string()},
               output_path, kMinTimeoutSeconds, stop_);
  if (result.Succeeded() && std::filesystem::exists(template_path_)) return;
  ThrowIfUnusable(work_path_);
  const std::string lines = LastLines(output_path, 5);
  throw ColmapError("`" + executable + " database_creator` " + result.Describe() +
                    " and made no database in " + work_path_.string() + ".\n" + lines +
                    (lines.empty() ? "" : "\n") +
                    "This COLMAP does not work; name another with --colmap_path.");
}

TwoViewConfiguration ColmapVerifier::ConfigurationOfUnmatched() const {
  return std::make_pair(colmap_.major, colmap_.minor) < kFirstDegenerate
             ? TwoViewConfiguration::kUndefined
             : TwoViewConfiguration::kDegenerate;
}

std::string ColmapVerifier::AdviceOnFailure() const {
  if (!plan_.uses_gpu) return "";
  return "This COLMAP was built to use a GPU; on a machine without one add "
         "--SiftMatching.use_gpu 0.";
}

ColmapVerifier::Statistics ColmapVerifier::SoFar() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return statistics_;
}

double ColmapVerifier::Timeout(std::size_t num_pairs, Trials trials) const {
  const double timeout = options_.timeout_per_pair * static_cast<double>(num_pairs + 1);
  const std::lock_guard<std::mutex> lock(mutex_);
  const double slowest = slowest_seconds_per_pair_[static_cast<std::size_t>(trials)];
  if (slowest <= 0) return timeout;
  return std::min(timeout,
                  kMinTimeoutSeconds + kPatience * slowest * static_cast<double>(num_pairs));
}

std::map<ImageId, std::size_t> ColmapVerifier::NumFeatures(
    const std::vector<PairToVerify>& pairs) const {
  std::map<ImageId, std::size_t> num_features;
  for (const PairToVerify& asked : pairs) {
    for (const ImageId id : {asked.pair.id1, asked.pair.id2}) {
      num_features[id] = num_features_.at(id);
    }
  }
  return num_features;
}

ShardFeatures ColmapVerifier::MakeShard(const std::filesystem::path& directory,
                                        const std::vector<PairToVerify>& pairs) const {
  const std::filesystem::path shard_path = ShardPath(directory);
  const std::filesystem::path list_path = ListPath(directory);
  ShardFeatures features;
  try {
    std::filesystem::copy_file(template_path_, shard_path);
    std::vector<ShardPair> rows;
    rows.reserve(pairs.size());
    for (const PairToVerify& pair : pairs) rows.push_back({pair.pair, pair.matches});
    features = FillShard(shard_path, database_path_, {options_.lock_timeout, &stop_}, rows,
                         shards_have_descriptors_);
  } catch (const std::filesystem::filesystem_error& error) {
    ThrowIfUnusable(work_path_);
    throw FileError("Cannot make a shard in the working directory: " + std::string(error.what()) +
                    ". Name another directory with --GraphMatching.work_path.");
  } catch (const DatabaseError&) {
    ThrowIfUnusable(work_path_);
    throw;
  }
  std::ofstream list(list_path);
  for (const PairToVerify& asked : pairs) {
    list << ShardImageName(asked.pair.id1) << ' ' << ShardImageName(asked.pair.id2) << '\n';
  }
  list.close();
  if (!list) ThrowIfUnusable(work_path_);
  if (!list) throw FileError("Cannot write " + list_path.string() + ". Is the disk full?");
  return features;
}

std::vector<std::string> ColmapVerifier::Command(const std::filesystem::path& directory,
                                                 Trials trials) const {
  std::vector<std::string> command = {colmap_.executable.string(),
                                      "matches_importer",
                                      "--database_path",
                                      ShardPath(directory).string(),
                                      "--match_list_path",
                                      ListPath(directory).string(),
                                      "--match_type",
                                      "pairs"};
  const std::vector<std::string>& arguments =
      trials == Trials::kForHalfInliers ? arguments_for_half_ : arguments_;
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

ShardOutcome ColmapVerifier::Verify(const std::vector<PairToVerify>& pairs, Trials trials,
                                    const std::function<bool()>& should_stop) {
  const WorkDirectory directory(work_path_);
  const std::filesystem::path output_path = directory.Path() / "output.txt";
  const ShardFeatures features = MakeShard(directory.Path(), pairs);
  const SubprocessResult run = RunSubprocess(Command(directory.Path(), trials), output_path,
                                             Timeout(pairs.size(), trials), should_stop);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    statistics_.seconds += run.seconds;
  }
  ShardOutcome outcome;
  outcome.stopped = run.ending == SubprocessResult::Ending::kStopped;
  if (outcome.stopped) return outcome;
  const std::string last_lines = run.Succeeded() ? "" : LastLines(output_path, kNumLastLines);
  if (last_lines.find(std::strerror(EAGAIN)) != std::string::npos) {
    throw SystemLimitError(
        "COLMAP " + run.Describe() +
        ", perhaps since it could not start its threads. The system lets this user or container "
        "have no more processes and threads: raise that "
        "limit (ulimit -u, Docker's --pids-limit), or use fewer with --SiftMatching.num_threads.");
  }
  if (!run.Succeeded()) {
    outcome.problem = run.Describe() + ":\n" + last_lines;
  } else {
    try {
      std::vector<ImagePair> asked;
      asked.reserve(pairs.size());
      for (const PairToVerify& pair : pairs) asked.push_back(pair.pair);
      outcome.results = ReadShard(ShardPath(directory.Path()), asked, NumFeatures(pairs), features);
    } catch (const DatabaseError& error) {
      outcome.problem = std::string("ended without an error, but: ") + error.what() + "\n" +
                        LastLines(output_path, kNumLastLines);
    }
  }
  if (!outcome.problem.empty()) {
    ThrowIfUnusable(work_path_);
    return outcome;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  statistics_.num_verified += pairs.size();
  double& slowest = slowest_seconds_per_pair_[static_cast<std::size_t>(trials)];
  slowest = std::max(slowest, run.seconds / static_cast<double>(pairs.size()));
  return outcome;
}

}  // namespace colmap_graphmatch
