#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/two_view_geometry.h"
#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {

struct PairToVerify {
  ImagePair pair;
  // None: those that the database has, or, if COLMAP matches, its own.
  std::optional<FeatureMatches> matches;
  // Of the matches, for a verifier that needs points.
  std::vector<PointPair> points = {};
  std::vector<float> distinctness = {};  // See DescriptorMatcher; empty if it is not known.
};

// What became of a shard that a GeometryVerifier was given.
struct ShardOutcome {
  std::vector<PairGeometry> results;  // Of all pairs, in their order, unless something was wrong:
  std::string problem;                // what, e.g. "ended with exit code 1"; empty if nothing did.
  bool stopped = false;               // should_stop ended it: neither results nor a problem.
  bool asked_colmap = true;           // Else the results do not say whether COLMAP works.
};

// Finds the two-view geometries of the pairs of one shard: pairs with matches in, geometries out.
// Knows nothing of batches, of other shards or of who asks. Thread-safe: every call is a shard of
// its own.
class GeometryVerifier {
 public:
  virtual ~GeometryVerifier() = default;

  // Whether pairs are to be given with their points.
  virtual bool NeedsPoints() const { return false; }

  // should_stop is asked often. Throws SystemLimitError if the system lacks what it takes for now,
  // StoppedError, and DatabaseError or FileError if it cannot go on.
  virtual ShardOutcome Verify(const std::vector<PairToVerify>& pairs,
                              const std::function<bool()>& should_stop) = 0;

  // For a pair with too few matches to be given to Verify.
  virtual TwoViewConfiguration ConfigurationOfUnmatched() const = 0;

  // How many times as many pairs as COLMAP alone it should get, so that they are worth a start of
  // COLMAP; fewer only in batches that would keep few cores busy.
  virtual std::size_t UsualSizeOfShards() const { return 1; }

  // What a user is told who asks why it fails on everything; empty, or a sentence.
  virtual std::string AdviceOnFailure() const { return ""; }
};

}  // namespace colmap_graphmatch
