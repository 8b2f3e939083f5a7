#include "colmap_graphmatch/verification/colmap_installation.h"

#include <unistd.h>

#include <algorithm>
#include <boost/process/search_path.hpp>
#include <cstddef>
#include <deque>
#include <fstream>
#include <regex>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/verification/subprocess.h"
#include "colmap_graphmatch/verification/work_directory.h"

namespace colmap_graphmatch {
namespace {

constexpr std::pair<int, int> kOldestVersion(3, 8);

// A COLMAP that does not even print its help within this time hangs.
constexpr double kHelpTimeoutSeconds = 60;

// What is looked at of a program's help (COLMAP's has some 10 KB), of the end of its output, and of
// a line of that: a program that is not COLMAP, or a COLMAP that is broken, may print anything.
constexpr std::size_t kMaxHelpBytes = 1 << 20;
constexpr std::streamoff kMaxOutputBytes = 16 << 10;
constexpr std::size_t kMaxLineBytes = 300;

std::filesystem::path FindExecutable(const std::string& colmap_path) {
  const bool is_name = colmap_path.find('/') == std::string::npos;
  std::filesystem::path found = is_name ? boost::process::search_path(colmap_path).string()
                                        : std::filesystem::absolute(colmap_path).string();
  std::error_code error;
  if (found.empty() || !std::filesystem::exists(found, error)) {
    throw ColmapError((is_name ? "There is no program \"" + colmap_path + "\" on the PATH"
                               : "There is no program at " + colmap_path) +
                      ". Install COLMAP (Debian: apt-get install colmap) or say where it is with "
                      "--colmap_path.");
  }
  if (std::filesystem::is_directory(found, error)) {
    throw ColmapError(found.string() +
                      " is a directory. Name the program in it with --colmap_path.");
  }
  if (::access(found.c_str(), X_OK) != 0) {
    throw ColmapError(found.string() +
                      " may not be executed. Give it the right with chmod +x, or name another "
                      "program with --colmap_path.");
  }
  return found;
}

std::string Output(const std::vector<std::string>& command, const std::filesystem::path& path,
                   const StopRequest& stop) {
  const SubprocessResult result = RunTwice(command, path, kHelpTimeoutSeconds, stop);
  // Even after success: help that is cut off would seem to lack options.
  ThrowIfUnusable(path.parent_path());
  if (!result.Succeeded()) {
    const std::string lines = LastLines(path, 5);
    throw ColmapError("`" + command[0] + " " + command[1] + "` " + result.Describe() +
                      (lines.empty() ? "." : ":\n" + lines) +
                      "\nThis program does not work as a COLMAP; name another with --colmap_path.");
  }
  std::ifstream file(path);
  std::string output(kMaxHelpBytes, '\0');
  file.read(output.data(), static_cast<std::streamsize>(output.size()));
  output.resize(static_cast<std::size_t>(file.gcount()));
  return output;
}

}  // namespace

bool IsOnPath(const std::string& name) { return !boost::process::search_path(name).empty(); }

std::string WithoutGroup(const std::string& option) { return option.substr(option.find('.') + 1); }

std::string ColmapInstallation::Version() const {
  return std::to_string(major) + "." + std::to_string(minor) +
         (patch > 0 ? "." + std::to_string(patch) : "");
}

std::string ColmapInstallation::Spelling(const std::string& option) const {
  if (matcher_options.count(option) > 0) return option;
  const std::string bare = WithoutGroup(option);
  for (const char* group : {"SiftMatching.", "TwoViewGeometry.", "FeatureMatching."}) {
    if (matcher_options.count(group + bare) > 0) return group + bare;
  }
  // The seed of everything random has no group, and another name before COLMAP 3.13.
  if (option == "default_random_seed") {
    for (const char* name : {"default_random_seed", "random_seed"}) {
      if (matcher_options.count(name) > 0) return name;
    }
  }
  return "";
}

std::vector<std::string> ColmapInstallation::Arguments(
    const std::map<std::string, std::string>& options, std::vector<std::string>* unknown) const {
  std::vector<std::string> arguments;
  for (const auto& [name, value] : options) {
    const std::string spelling = Spelling(name);
    if (spelling.empty()) {
      unknown->push_back(name);
    } else {
      arguments.push_back("--" + spelling);
      arguments.push_back(value);
    }
  }
  return arguments;
}

ColmapInstallation DetectColmap(const std::string& colmap_path,
                                const std::filesystem::path& work_path, const StopRequest& stop) {
  ColmapInstallation colmap;
  colmap.executable = FindExecutable(colmap_path);
  const std::string executable = colmap.executable.string();
  const std::string help = Output({executable, "help"}, work_path / "help.txt", stop);

  // Every repetition has a limit: std::regex needs stack for each letter that one matches.
  static const std::regex kVersion(R"(COLMAP (\d{1,4})\.(\d{1,4})(?:\.(\d{1,4}))?)");
  std::smatch version;
  if (!std::regex_search(help, version, kVersion)) {
    throw ColmapError(executable +
                      " is not COLMAP: its help does not say a version. Name the program with "
                      "--colmap_path.");
  }
  colmap.major = std::stoi(version[1]);
  colmap.minor = std::stoi(version[2]);
  colmap.patch = version[3].matched ? std::stoi(version[3]) : 0;
  if (std::make_pair(colmap.major, colmap.minor) < kOldestVersion) {
    throw ColmapError(executable + " is COLMAP " + colmap.Version() +
                      "; this program needs 3.8 or later. Name another one with --colmap_path.");
  }
  // "with CUDA", "without CUDA"; 4.x: "with GPU support (CUDA ...)", "without GPU support".
  static const std::regex kGpu(R"(\bwith (CUDA|GPU))");
  colmap.has_gpu = std::regex_search(help, kGpu);

  const std::string options =
      Output({executable, "matches_importer", "-h"}, work_path / "options.txt", stop);
  static const std::regex kOption(R"(--([A-Za-z_]{1,50}(?:\.[A-Za-z0-9_]{1,50})?))");
  for (std::sregex_iterator match(options.begin(), options.end(), kOption), end; match != end;
       ++match) {
    colmap.matcher_options.insert((*match)[1]);
  }
  return colmap;
}

std::string LastLines(const std::filesystem::path& output_path, std::size_t num_lines) {
  std::ifstream file(output_path);
  file.seekg(0, std::ios::end);
  file.seekg(
      std::max<std::streamoff>(0, static_cast<std::streamoff>(file.tellg()) - kMaxOutputBytes));
  std::deque<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    if (line.size() > kMaxLineBytes) line = line.substr(0, kMaxLineBytes) + " ...";
    lines.push_back(line);
    if (lines.size() > num_lines) lines.pop_front();
  }
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "\n") + line;
  return text;
}

}  // namespace colmap_graphmatch
