// Stateless randomness: every random quantity is a hash of what it belongs to, so that pictures do
// not depend on the order in which threads draw them.

#pragma once

#include <cstdint>

namespace colmap_graphmatch::synthetic {

// Finaliser of MurmurHash3.
inline uint32_t Mix(uint32_t h) {
  h ^= h >> 16;
  h *= 0x85EBCA6Bu;
  h ^= h >> 13;
  h *= 0xC2B2AE35u;
  h ^= h >> 16;
  return h;
}

inline uint32_t Hash(uint32_t a, uint32_t b) { return Mix(a * 0x9E3779B1u + Mix(b + 0x7F4A7C15u)); }

// In [0, 1).
inline float Uniform(uint32_t hash) { return static_cast<float>(hash >> 8) * 0x1p-24f; }

inline float Uniform(uint32_t hash, float low, float high) {
  return low + (high - low) * Uniform(hash);
}

// A sequence of hashes, for code that needs many values in a fixed order.
class HashSequence {
 public:
  explicit HashSequence(uint32_t seed) : seed_(seed) {}
  uint32_t Next() { return Hash(seed_, counter_++); }
  float Uniform(float low, float high) { return synthetic::Uniform(Next(), low, high); }

 private:
  uint32_t seed_;
  uint32_t counter_ = 0;
};

}  // namespace colmap_graphmatch::synthetic
