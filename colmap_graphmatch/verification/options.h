#pragma once

#include <map>
#include <string>

#include "colmap_graphmatch/base/enum_words.h"
#include "colmap_graphmatch/matching/options.h"
#include "colmap_graphmatch/verification/geometry_options.h"

namespace colmap_graphmatch {

// Of matching by this library.
struct ExactMatcherOptions {
  DescriptorMatchingOptions matching;

  // Descriptors kept in memory, in units of 10^9 bytes; 0: a quarter of the memory. What does not
  // fit is read again, with the same result.
  double cache_gb = 0;

  // Throws OptionsError.
  void Check() const;
};

struct VerificationOptions {
  // Who matches descriptors; COLMAP gets the options of exact.matching. kAuto: COLMAP if it has a
  // GPU and may use it, else this library.
  enum class Matcher { kAuto, kExact, kColmap };
  Matcher matcher = Matcher::kAuto;

  // Who decides whether a pair is an edge. kColmap: COLMAP alone. kScreened: the same, but a fast
  // fit goes first. kNative: this library. kAuto: kScreened, or kNative where no COLMAP was named
  // and none is on the PATH. Where COLMAP matches, it also verifies.
  enum class Verifier { kAuto, kScreened, kColmap, kNative };
  Verifier verifier = Verifier::kAuto;

  ExactMatcherOptions exact;

  // COLMAP processes at a time. 0: as many as threads, of one thread each, without a GPU; one with
  // it. Each gets threads / num_processes, at least 1. Descriptors are matched by one thread for
  // each process, when that process does not run.
  int num_processes = 0;

  // Whether COLMAP matches on the GPU; without effect on a COLMAP that was built without.
  bool use_gpu = true;

  GeometryOptions geometry;

  // Other options of COLMAP's, by their names in any version (e.g. "SiftMatching.gpu_index") or
  // without a group, as COLMAP is to get them. What is not here keeps COLMAP's own default. Those
  // of exact.matching and geometry do not belong here: COLMAP gets them from there.
  std::map<std::string, std::string> colmap_options;

  // Pairs a shard at most, the amount of work that a crash of COLMAP or kill -9 can lose.
  int max_pairs_per_shard = 64;

  // Seconds that COLMAP may take for a pair before it counts as hanging. Once shards have come
  // back, one that takes more than 20 times as long a pair as the slowest of them counts as
  // hanging, too.
  double timeout_per_pair = 60;

  // Seconds to wait for locks of other processes on the user's database, on its state file and on a
  // replayed database.
  double lock_timeout = 60;

  // Throws OptionsError.
  void Check() const;
};

inline constexpr EnumWords<VerificationOptions::Matcher, 3> kMatcherWords = {
    {{VerificationOptions::Matcher::kAuto, "auto"},
     {VerificationOptions::Matcher::kExact, "exact"},
     {VerificationOptions::Matcher::kColmap, "colmap"}}};

inline constexpr EnumWords<VerificationOptions::Verifier, 4> kVerifierWords = {
    {{VerificationOptions::Verifier::kAuto, "auto"},
     {VerificationOptions::Verifier::kScreened, "screened"},
     {VerificationOptions::Verifier::kColmap, "colmap"},
     {VerificationOptions::Verifier::kNative, "native"}}};

}  // namespace colmap_graphmatch
