// benchmark_preprocessing DATABASE [RUNS [NUM_THREADS]]: the time of every stage before the first
// pair is tested, several times in a row, and the peak memory of the process.

#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdlib>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/ranking/ranking.h"
#include "colmap_graphmatch/vectors/image_vectors.h"

namespace colmap_graphmatch {
namespace {

void Run(const char* path, int num_threads) {
  const Stopwatch stopwatch;
  ThreadPool threads(num_threads);
  Database database(path, sqlite::Access::kRead, 10);
  const std::vector<ImageRecord> images = WithFeatures(database.ReadImages());
  const double read = stopwatch.Seconds();
  const ImageVectorOptions options;
  const VectorModelTraining training =
      LearnVectorModel(options, 0, database, images, threads, StopRequest());
  const double mixture = stopwatch.Seconds() - read;
  std::vector<float> vectors =
      EncodeImages(options, training.model, database, images, threads, StopRequest());
  const double encode = stopwatch.Seconds() - read - mixture;
  const std::size_t dim = vectors.size() / images.size();
  const VectorRanking ranking(RankingOptions(), images.size(), dim, std::move(vectors), threads);
  const double rank = stopwatch.Seconds() - read - mixture - encode;
  rusage usage = {};
  ::getrusage(RUSAGE_SELF, &usage);
  fmt::print("{:>8} {:>10.3f} {:>12.3f} {:>4} {:>15.3f} {:>10.3f} {:>9.3f} {:>9.0f}\n",
             images.size(), read, mixture, training.num_iterations, encode, rank,
             read + mixture + encode + rank, static_cast<double>(usage.ru_maxrss) / 1024);
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "benchmark_preprocessing DATABASE [RUNS [NUM_THREADS]]\n");
    return 1;
  }
  const int num_runs = argc > 2 ? std::atoi(argv[2]) : 5;
  const int num_threads = argc > 3 ? std::atoi(argv[3]) : -1;
  fmt::print("{:>8} {:>10} {:>12} {:>4} {:>15} {:>10} {:>9} {:>9}\n", "images", "list s",
             "read+GMM s", "EM", "read+Fisher s", "ranking s", "sum s", "peak MB");
  for (int run = 0; run < num_runs; ++run) colmap_graphmatch::Run(argv[1], num_threads);
  return 0;
}
