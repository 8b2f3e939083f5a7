// make_fuzz_corpus DIR: what fuzzing begins with, DIR/fuzz_database and DIR/fuzz_options.

#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "colmap_graphmatch/base/types.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

void MakeDatabase(const std::filesystem::path& path, Schema schema, int page_size) {
  std::filesystem::remove(path);
  WriteSyntheticDatabase(path, schema, MakePlaces(2, 2, 10, 1));
  sqlite::Connection database(path, sqlite::Access::kReadWrite, 1);
  const auto key = [](ImageId a, ImageId b) { return std::to_string(EncodePair(ImagePair(a, b))); };
  database.Execute("INSERT INTO matches VALUES(" + key(1, 2) + ", 2, 2, zeroblob(16)), (" +
                   key(2, 3) + ", 2, 2, zeroblob(16))");
  database.Execute("INSERT INTO two_view_geometries(pair_id, rows, cols, data, config, F) VALUES(" +
                   key(1, 2) + ", 2, 2, zeroblob(16), 3, zeroblob(72))");
  // Small pages make small files with many of them.
  database.Execute("PRAGMA journal_mode = DELETE; PRAGMA page_size = " + std::to_string(page_size) +
                   "; VACUUM; CREATE TABLE gone(a BLOB); INSERT INTO gone VALUES(zeroblob(2000)); "
                   "DROP TABLE gone");
}

void MakeOptions(const std::filesystem::path& directory) {
  std::ofstream(directory / "project") << '\0'
                                       << "log_to_stderr=false\nrandom_seed=3\n"
                                          "database_path=data base.db\nimage_path=images\n"
                                          "[SiftMatching]\nuse_gpu=0\nmax_ratio=0.7\n"
                                          "num_threads=-1\n[TwoViewGeometry]\nmin_num_inliers=15\n"
                                          "[GraphMatching]\nstrategy=exhaustive\ncache_gb=1e3\n";
  std::ofstream(directory / "project_of_mapper") << '\4'
                                                 << "[Mapper]\nmin_num_matches=15\n"
                                                    "[FeatureMatching]\ngpu_index=-1\n"
                                                    "[VocabTreeMatching]\nnum_images=100\n"
                                                    "# a comment\n[ImageReader]\nmask_path=\n";
  std::ofstream(directory / "pairs") << '\1'
                                     << "# a comment\na.jpg b.jpg\n\na b.jpg c\n c c c 0.7\r\n"
                                        "c\tc c\nd a.jpg\nx c\n";
}

int Main(const std::filesystem::path& directory) {
  const std::filesystem::path databases = directory / "fuzz_database";
  std::filesystem::create_directories(databases);
  for (const int page_size : {512, 1024, 4096}) {
    const std::string suffix = std::to_string(page_size);
    MakeDatabase(databases / ("colmap38-" + suffix), Schema::kColmap38, page_size);
    MakeDatabase(databases / ("colmap310-" + suffix), Schema::kColmap310, page_size);
    MakeDatabase(databases / ("colmap42-" + suffix), Schema::kColmap42, page_size);
  }
  std::filesystem::create_directories(directory / "fuzz_options");
  MakeOptions(directory / "fuzz_options");
  return 0;
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "make_fuzz_corpus DIR\n";
    return 1;
  }
  return colmap_graphmatch::Main(argv[1]);
}
