#include "colmap_graphmatch/cli/run_files.h"

#include <system_error>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/base/output_file.h"
#include "colmap_graphmatch/database/sqlite.h"
#include "colmap_graphmatch/database/state_file.h"
#include "colmap_graphmatch/encoding/numpy_file.h"
#include "colmap_graphmatch/report/json_report.h"

namespace colmap_graphmatch {
namespace {

void AddDatabase(const std::string& option, const std::filesystem::path& path, RunFile::Use use,
                 std::vector<RunFile>* files) {
  files->push_back({option, path, use});
  for (const std::filesystem::path& beside : sqlite::FilesBeside(path)) {
    const std::string suffix = beside.string().substr(beside.string().rfind('-'));
    files->push_back({option + " with " + suffix, beside, use, path});
  }
}

bool IsSame(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ignored;
  // Of a relative path that is not there, weakly_canonical makes no absolute one.
  const auto whole = [&ignored](const std::filesystem::path& path) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path), ignored);
  };
  return std::filesystem::equivalent(a, b, ignored) || whole(a) == whole(b);
}

// Whether a file is what this program writes beside another, as far as can be told.
bool IsOurs(const RunFile& file) {
  std::error_code ignored;
  return !std::filesystem::exists(file.path, ignored) ||
         std::filesystem::exists(file.beside, ignored) || IsJsonReport(file.path);
}

}  // namespace

std::vector<RunFile> FilesOfRun(const CommandLine& line) {
  const PipelineOptions& p = line.pipeline;
  const ImageRankingOptions& ranking = p.ranking;
  std::vector<RunFile> files;
  AddDatabase("--database_path", p.database_path, RunFile::Use::kKept, &files);
  AddDatabase("--database_path with .graphmatch", StateFile::PathFor(p.database_path),
              RunFile::Use::kKept, &files);
  const auto read = [&files](const char* option, const std::filesystem::path& path) {
    if (!path.empty()) files.push_back({option, path, RunFile::Use::kRead});
  };
  read("--project_path", line.project_path);
  read("--GraphMatching.match_list_path", p.match_list_path);
  read("--VocabTreeMatching.match_list_path", p.image_list_path);
  read("--GraphMatching.ranking_path", ranking.ranking_path);
  if (!p.replay_path.empty()) {
    AddDatabase("--GraphMatching.replay_path", p.replay_path, RunFile::Use::kRead, &files);
  }
  const std::filesystem::path& vectors = ranking.vectors.vectors_path;
  read("--GraphMatching.vectors_path", vectors);
  if (!vectors.empty()) {
    files.push_back({"--GraphMatching.vectors_path with .txt", NamesPath(vectors),
                     RunFile::Use::kRead, vectors});
  }
  if (p.colmap_path.find('/') != std::string::npos) read("--colmap_path", p.colmap_path);

  const auto written = [&files](const char* option, const std::filesystem::path& path) {
    if (!path.empty()) files.push_back({option, path, RunFile::Use::kWritten});
  };
  written("--GraphMatching.report", line.report_path);
  if (IsPage(line.report_path)) {
    files.push_back({"--GraphMatching.report with .json", JsonReportPath(line.report_path),
                     RunFile::Use::kWritten, line.report_path});
  }
  written("--GraphMatching.export_pairs", line.pair_list_path);
  written("--GraphMatching.export_graph", line.graph_path);
  written("--GraphMatching.export_vectors", ranking.export_path);
  if (!ranking.export_path.empty()) {
    files.push_back({"--GraphMatching.export_vectors with .txt", NamesPath(ranking.export_path),
                     RunFile::Use::kWritten, ranking.export_path});
  }
  const auto grows = [&files](const char* option, const std::filesystem::path& path) {
    if (!path.empty()) files.push_back({option, path, RunFile::Use::kGrows});
  };
  grows("--GraphMatching.pair_log", p.pair_log_path);
  grows("--log_path", line.log.FilePath());
  return files;
}

void CheckThatFilesDiffer(const std::vector<RunFile>& files) {
  const auto is_output = [](const RunFile& file) {
    return file.use == RunFile::Use::kWritten || file.use == RunFile::Use::kGrows;
  };
  for (const RunFile& file : files) {
    if (!is_output(file)) continue;
    for (const RunFile& other : files) {
      if (&other == &file || !IsSame(file.path, other.path)) continue;
      if (is_output(other) && !IsReplacedAsAWhole(file.path)) continue;
      throw OptionsError(file.option + " and " + other.option + " are the same file, " +
                         file.path.string() + ": one would take the place of the other.");
    }
  }
}

void CheckOutputs(const std::vector<RunFile>& files) {
  for (const RunFile& file : files) {
    if (file.use != RunFile::Use::kWritten) continue;
    CheckCanWrite(file.path);
    if (file.beside.empty() || IsOurs(file)) continue;
    throw FileError(file.option + " is " + file.path.string() +
                    ", which is there already, without " + file.beside.filename().string() +
                    " beside it. It may be another file of yours: move it, delete it, or give "
                    "another name.");
  }
}

}  // namespace colmap_graphmatch
