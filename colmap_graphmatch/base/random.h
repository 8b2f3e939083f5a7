#pragma once

#include <cstdint>
#include <initializer_list>

namespace colmap_graphmatch {

// A small random generator (SplitMix64, Steele, Lea and Flood, OOPSLA 2014) that is seeded by a
// stable hash of what the numbers are for, e.g. (seed, stage, image id). Numbers therefore never
// depend on threads, on the order of calls elsewhere, or on the standard library in use.
class Random {
 public:
  explicit Random(std::initializer_list<std::uint64_t> keys) {
    for (const std::uint64_t key : keys) {
      state_ ^= key;
      state_ = Next();
    }
  }

  std::uint64_t Next() {
    state_ += 0x9E3779B97F4A7C15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }

  // Uniform in [0, 1).
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }

  // Uniform in [0, n); n > 0. The bias of the multiplication is below n / 2^53.
  std::uint64_t Index(std::uint64_t n) {
    const auto index = static_cast<std::uint64_t>(Uniform() * static_cast<double>(n));
    return index < n ? index : n - 1;
  }

 private:
  std::uint64_t state_ = 0;
};

// The stages that draw random numbers: the second key of their generators.
enum class RandomStage : std::uint64_t {
  kTrainingSample = 1,
  kKMeans = 2,
  kVocabulary = 3,
};

}  // namespace colmap_graphmatch
