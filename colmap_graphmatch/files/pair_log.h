#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/output_file.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/graph/exploration.h"

namespace colmap_graphmatch {

// Writes every pair that a run tests to a CSV file (docs/formats.md), in the order of the answers.
class PairLog {
 public:
  // Throws FileError if the file cannot be written.
  PairLog(const std::filesystem::path& path, const std::vector<ImageRecord>& images);

  // The pair that the progress reports, unless an earlier run had tested it.
  void Write(const LoopProgress& progress, double seconds);

  // Throws FileError if not everything could be written.
  void Close();

 private:
  std::filesystem::path path_;
  GrowingFile file_;
  std::map<ImageId, std::string> names_;  // As fields of CSV.
  std::size_t num_written_ = 0;
};

}  // namespace colmap_graphmatch
