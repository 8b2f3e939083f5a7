// A test double of COLMAP: the three commands that the verifier calls, on real databases, with the
// faults that environment variables ask for. Images match if their ids lie in the same ten.
//
//   FAKE_COLMAP_VERSION      what `help` says, e.g. "COLMAP 4.2.1 (without GPU support)"
//   FAKE_COLMAP_SCHEMA       38, 310 or 42
//   FAKE_COLMAP_GROUP        the group of all options in `matches_importer -h`
//   FAKE_COLMAP_FAULT        crash, exit, hang, nothing, nonsense, short: what happens on ...
//   FAKE_COLMAP_FAULT_PAIR   ... the pair "id1 id2", or on every pair: "all"
//   FAKE_COLMAP_FAULT_TIMES  how often it happens (default: always); counted in FAKE_COLMAP_LOG
//   FAKE_COLMAP_FAULT_IMAGE  ... or on every pair of this image
//   FAKE_COLMAP_DELAY_MS     time a pair takes
//   FAKE_COLMAP_HELP_DELAY_MS  time that `help` takes
//   FAKE_COLMAP_LOG          a file that gets a line for every run and every pair

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/database/sqlite.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

constexpr std::int64_t kNumInliers = 20;

std::string Environment(const char* name, const std::string& otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : value;
}

void Log(const std::string& line) {
  const std::string path = Environment("FAKE_COLMAP_LOG", "");
  if (!path.empty()) std::ofstream(path, std::ios::app) << line << std::endl;
}

int CountInLog(const std::string& line) {
  std::ifstream file(Environment("FAKE_COLMAP_LOG", ""));
  int count = 0;
  for (std::string text; std::getline(file, text);) count += text == line ? 1 : 0;
  return count;
}

void WritePair(sqlite::Connection* database, const ImagePair& pair, bool nonsense) {
  const bool is_edge = pair.id1 / 10 == pair.id2 / 10;
  const std::int64_t rows = is_edge ? kNumInliers : 0;
  sqlite::Blob data;
  for (std::int64_t i = 0; i < rows; ++i) {
    const auto feature = static_cast<std::uint32_t>(nonsense ? 1000000 + i : i);
    for (int side = 0; side < 2; ++side) {
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(&feature);
      data.insert(data.end(), bytes, bytes + sizeof(feature));
    }
  }
  const auto pair_id = static_cast<std::int64_t>(EncodePair(pair));
  sqlite::Statement matches(*database, "INSERT OR REPLACE INTO matches VALUES(?1, ?2, 2, ?3)");
  matches.Bind(1, pair_id).Bind(2, rows).Bind(3, data).Run();
  sqlite::Statement geometry(
      *database,
      "INSERT INTO two_view_geometries(pair_id, rows, cols, data, config, F, E, H) "
      "VALUES(?1, ?2, 2, ?3, ?4, ?5, NULL, zeroblob(72))");
  const sqlite::Blob matrix(72, 1);
  geometry.Bind(1, pair_id).Bind(2, rows).Bind(3, data).Bind(4, std::int64_t{is_edge ? 3 : 0});
  geometry.Bind(5, is_edge ? matrix : sqlite::Blob()).Run();
}

int CreateDatabase(const std::string& path) {
  const std::string schema = Environment("FAKE_COLMAP_SCHEMA", "38");
  CreateColmapDatabase(path, schema == "42"    ? Schema::kColmap42
                             : schema == "310" ? Schema::kColmap310
                                               : Schema::kColmap38);
  return 0;
}

int ImportMatches(const std::map<std::string, std::string>& options) {
  sqlite::Connection database(options.at("--database_path"), sqlite::Access::kReadWrite, 0);
  std::string arguments;
  for (const auto& [name, value] : options) {
    if (name.find('.') != std::string::npos) arguments += " " + name + "=" + value;
  }
  Log("run" + arguments);
  const auto mode = std::filesystem::status(database.Path().parent_path()).permissions();
  Log(mode == std::filesystem::perms::owner_all ? "private directory" : "open directory");
  const std::string fault = Environment("FAKE_COLMAP_FAULT", "");
  const std::string fault_pair = Environment("FAKE_COLMAP_FAULT_PAIR", "");
  const auto fault_image =
      static_cast<ImageId>(std::stoul(Environment("FAKE_COLMAP_FAULT_IMAGE", "0")));
  const int fault_times = std::stoi(Environment("FAKE_COLMAP_FAULT_TIMES", "1000000"));
  const int delay = std::stoi(Environment("FAKE_COLMAP_DELAY_MS", "0"));

  std::map<std::string, ImageId> ids;
  sqlite::Statement images(database, "SELECT name, image_id FROM images");
  while (images.Step()) ids[images.Text(0)] = static_cast<ImageId>(images.Int(1));

  sqlite::Statement descriptors(database, "SELECT count(*) FROM descriptors");
  descriptors.Step();
  Log("descriptors of " + std::to_string(descriptors.Int(0)) + " images");
  sqlite::Statement given(database, "SELECT rows FROM matches WHERE pair_id = ?1");

  std::ifstream list(options.at("--match_list_path"));
  std::string name1;
  std::string name2;
  while (list >> name1 >> name2) {
    const ImagePair pair(ids.at(name1), ids.at(name2));
    const std::string text = std::to_string(pair.id1) + " " + std::to_string(pair.id2);
    std::this_thread::sleep_for(std::chrono::milliseconds(delay));
    given.Bind(1, static_cast<std::int64_t>(EncodePair(pair)));
    if (given.Step()) Log("given " + text + ": " + std::to_string(given.Int(0)));
    given.Reset();
    bool nonsense = false;
    if (!fault.empty() &&
        (text == fault_pair || fault_pair == "all" || pair.id1 == fault_image ||
         pair.id2 == fault_image) &&
        CountInLog("fault") < fault_times) {
      Log("fault");
      std::cerr << "a made-up fault on the pair " << text << std::endl;
      if (fault == "crash") std::raise(SIGKILL);
      if (fault == "exit") return 1;
      if (fault == "hang") std::this_thread::sleep_for(std::chrono::hours(1));
      if (fault == "short") return 0;
      if (fault == "nothing") continue;
      nonsense = fault == "nonsense";
    }
    WritePair(&database, pair, nonsense);
    Log("pair " + text);
  }
  return 0;
}

int Main(const std::vector<std::string>& arguments) {
  const std::string command = arguments.empty() ? "help" : arguments[0];
  if (command == "help") {
    std::this_thread::sleep_for(
        std::chrono::milliseconds(std::stoi(Environment("FAKE_COLMAP_HELP_DELAY_MS", "0"))));
    std::cout << Environment("FAKE_COLMAP_VERSION",
                             "COLMAP 3.8 -- Structure-from-Motion\n(without CUDA)")
              << std::endl;
    return 0;
  }
  const std::string group = "--" + Environment("FAKE_COLMAP_GROUP", "SiftMatching") + ".";
  const std::vector<std::string> known = {
      group + "use_gpu",         group + "num_threads",    group + "max_ratio",
      group + "min_num_inliers", group + "max_num_trials", group + "min_inlier_ratio",
      "--database_path",         "--match_list_path",      "--match_type"};
  if (arguments.size() > 1 && arguments[1] == "-h") {
    for (const std::string& option : known) std::cout << "  " << option << " arg\n";
    return 0;
  }
  std::map<std::string, std::string> options;
  for (std::size_t i = 1; i + 1 < arguments.size(); i += 2) {
    if (std::find(known.begin(), known.end(), arguments[i]) == known.end()) {
      std::cerr << "ERROR: Failed to parse options: unrecognised option '" << arguments[i] << "'\n";
      return 1;
    }
    options[arguments[i]] = arguments[i + 1];
  }
  if (command == "database_creator") return CreateDatabase(options.at("--database_path"));
  if (command == "matches_importer") return ImportMatches(options);
  return 1;
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  return colmap_graphmatch::Main(std::vector<std::string>(argv + 1, argv + argc));
}
