#pragma once

#include <functional>
#include <string>
#include <vector>

#include "colmap_graphmatch/database/database.h"
#include "colmap_graphmatch/database/shard.h"

namespace colmap_graphmatch {

// What became of a shard that a GeometryVerifier was given.
struct ShardOutcome {
  std::vector<PairGeometry> results;  // Of all pairs, in their order, unless something was wrong:
  std::string problem;                // what, e.g. "ended with exit code 1"; empty if nothing did.
  bool stopped = false;               // should_stop ended it: neither results nor a problem.
};

// Finds the two-view geometries of the pairs of one shard: pairs with matches in, geometries out.
// Knows nothing of batches, of other shards or of who asks. Thread-safe: every call is a shard of
// its own.
class GeometryVerifier {
 public:
  virtual ~GeometryVerifier() = default;

  // should_stop is asked often. Throws SystemLimitError if the system lacks what it takes for now,
  // StoppedError, and DatabaseError or FileError if it cannot go on.
  virtual ShardOutcome Verify(const std::vector<ShardPair>& pairs,
                              const std::function<bool()>& should_stop) = 0;

  // For a pair with too few matches to be given to Verify.
  virtual TwoViewConfiguration ConfigurationOfUnmatched() const = 0;

  // What a user is told who asks why it fails on everything; empty, or a sentence.
  virtual std::string AdviceOnFailure() const { return ""; }
};

}  // namespace colmap_graphmatch
