#include "colmap_graphmatch/files/pair_log.h"

#include <array>
#include <cstdio>
#include <cstring>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

// Quoted if it has to be (RFC 4180).
std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + "\"";
}

}  // namespace

PairLog::PairLog(const std::filesystem::path& path, const std::vector<ImageRecord>& images)
    : path_(path), file_(path, GrowingFile::Mode::kAnew) {
  for (const ImageRecord& image : images) names_[image.id] = CsvField(image.name);
  file_ << "test,seconds,stage,iteration,image1,image2,inliers,edge\n" << std::flush;
}

void PairLog::Write(const LoopProgress& progress, double seconds) {
  if (progress.last.is_known || progress.last.outcome == PairOutcome::kFailed) return;
  std::array<char, 32> time = {};
  std::snprintf(time.data(), time.size(), "%.4f", seconds);
  file_ << ++num_written_ << ',' << time.data() << ',' << StageName(progress.stage) << ','
        << progress.iteration << ',' << names_.at(progress.last.pair.id1) << ','
        << names_.at(progress.last.pair.id2) << ',' << progress.last.num_inliers << ','
        << (progress.last.outcome == PairOutcome::kEdge ? 1 : 0) << '\n';
}

void PairLog::Close() {
  file_.flush();
  if (file_.Error() == 0) return;
  throw FileError("Cannot write the log of pairs " + path_.string() + ": " +
                  std::strerror(file_.Error()) + ".");
}

}  // namespace colmap_graphmatch
