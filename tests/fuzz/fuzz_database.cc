// libFuzzer: the input is a database file. Everything that the program reads from one is read, a
// pair is written to it, and shards are filled from it. Errors of base/errors.h are fine.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/largest_scales.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/database/shard.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

constexpr std::array<Schema, 3> kSchemas = {Schema::kColmap38, Schema::kColmap310,
                                            Schema::kColmap42};
constexpr std::size_t kMaxImages = 20;

class Fuzzer {
 public:
  Fuzzer() {
    for (std::size_t i = 0; i < kSchemas.size(); ++i) {
      CreateColmapDatabase(Template(i), kSchemas[i]).Execute("PRAGMA journal_mode = DELETE");
    }
  }

  void Run(const std::uint8_t* data, std::size_t size) {
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
      std::filesystem::remove(path_.string() + suffix);
    }
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
      Read(size);
    } catch (const Error&) {
    }
  }

 private:
  std::filesystem::path Template(std::size_t schema) const {
    return directory_.Path() / ("template" + std::to_string(schema));
  }

  void Read(std::size_t choice) {
    Database database(path_, sqlite::Access::kReadWrite, 0);
    Try([&] {
      for (const TestedPair& tested : database.ReadTestedPairs()) database.ReadInliers(tested.pair);
    });
    Try([&] { database.ReadCameras(); });
    std::vector<ImagePair> unverified;
    Try([&] { unverified = database.ReadUnverifiedPairs(); });
    const std::vector<ImageRecord> images = WithFeatures(database.ReadImages());
    const std::size_t num_images = std::min(images.size(), kMaxImages);
    for (std::size_t i = 0; i < num_images; ++i) {
      Try([&] {
        const Descriptors descriptors = database.ReadDescriptors(images[i]);
        const Keypoints keypoints = database.ReadKeypoints(images[i].id);
        descriptors.CopyRows(SelectLargestScales(keypoints.Scales(descriptors.num_rows), 7));
      });
    }

    std::vector<ShardPair> pairs;
    for (std::size_t i = 0; i + 1 < num_images; ++i) {
      pairs.push_back({ImagePair(images[i].id, images[i + 1].id), FeatureMatches(2)});
    }
    // The matches of these are in the database.
    for (std::size_t i = 0; i < std::min(unverified.size(), kMaxImages); ++i) {
      pairs.push_back({unverified[i], std::nullopt});
    }
    const std::filesystem::path shard = directory_.Path() / "shard.db";
    for (const bool with_descriptors : {false, true}) {
      Try([&] {
        std::filesystem::copy_file(Template(choice % kSchemas.size()), shard,
                                   std::filesystem::copy_options::overwrite_existing);
        const ShardFeatures features = FillShard(shard, path_, 0, pairs, with_descriptors);
        std::map<ImageId, std::size_t> num_features;
        for (const ShardPair& pair : pairs) {
          num_features[pair.pair.id1] = 10;
          num_features[pair.pair.id2] = 10;
        }
        std::vector<ImagePair> asked;
        for (const ShardPair& pair : pairs) asked.push_back(pair.pair);
        ReadShard(shard, asked, num_features, features);
      });
    }
    PairGeometry result;
    result.pair = pairs.empty() ? ImagePair(1, 2) : pairs.front().pair;
    database.WritePairs({result});
  }

  // What cannot be read must not hide what comes after it.
  template <typename Function>
  static void Try(const Function& function) {
    try {
      function();
    } catch (const Error&) {
    }
  }

  TestDirectory directory_;
  std::filesystem::path path_ = directory_.Path() / "database.db";
};

// Bytes that no checksum guards are easily changed; what makes an input interesting here is a page
// that stands where another is expected, and a number that a length or a page has elsewhere.
std::size_t MutatePages(std::uint8_t* data, std::size_t size, std::size_t max_size,
                        std::uint64_t seed) {
  if (size < 1024) return 0;
  Random random({seed});
  const std::size_t page_size = std::max<std::size_t>(
      512, static_cast<std::size_t>(data[16]) << 8U | static_cast<std::size_t>(data[17]));
  const std::size_t num_pages = size / page_size;
  if (num_pages < 2) return 0;
  std::uint8_t* page = data + page_size * random.Index(num_pages);
  const std::uint8_t* other = data + page_size * random.Index(num_pages);
  switch (random.Index(4)) {
    case 0:
      std::copy_n(std::vector<std::uint8_t>(other, other + page_size).begin(), page_size, page);
      break;
    case 1: {
      std::uint8_t* number = page + random.Index(page_size - 4);
      std::fill_n(number, 3, std::uint8_t{0});
      number[3] = static_cast<std::uint8_t>(random.Index(num_pages + 2));
      break;
    }
    case 2:
      if (size + page_size > max_size) return 0;
      std::copy_n(std::vector<std::uint8_t>(other, other + page_size).begin(), page_size,
                  data + num_pages * page_size);
      size = (num_pages + 1) * page_size;
      data[30] = static_cast<std::uint8_t>((num_pages + 1) >> 8U);
      data[31] = static_cast<std::uint8_t>(num_pages + 1);
      break;
    default:
      page[random.Index(page_size)] = static_cast<std::uint8_t>(random.Next());
      page[random.Index(12)] = static_cast<std::uint8_t>(random.Next());
      break;
  }
  return size;
}

}  // namespace
}  // namespace colmap_graphmatch

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned int seed) {
  if (seed % 2 == 0) {
    const std::size_t mutated = colmap_graphmatch::MutatePages(data, size, max_size, seed);
    if (mutated > 0) return mutated;
  }
  return LLVMFuzzerMutate(data, size, max_size);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static colmap_graphmatch::Fuzzer fuzzer;
  fuzzer.Run(data, size);
  return 0;
}
