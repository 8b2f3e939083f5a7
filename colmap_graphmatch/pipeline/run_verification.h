#pragma once

#include <memory>
#include <optional>
#include <variant>

#include "colmap_graphmatch/base/pair_verifier.h"
#include "colmap_graphmatch/pipeline/result.h"
#include "colmap_graphmatch/pipeline/run_setup.h"

namespace colmap_graphmatch {

// What answers the pairs of a run, with all that it needs for that: matching and geometric
// verification, or a finished matching graph that is replayed. A new way to verify pairs is usually
// a GeometryVerifier that ChosenVerifier chooses, not another one of these.
class RunVerification {
 public:
  virtual ~RunVerification() = default;

  virtual PairVerifier& Verifier() = 0;

  // Of a replay: the modelled time so far.
  virtual std::optional<double> ModelledSeconds() const { return std::nullopt; }

  virtual std::variant<VerificationCost, ReplayCost> Cost() const = 0;

  // After the last pair. Throws DatabaseError if what was written is not where it belongs.
  virtual void Finish() {}
};

// What the kind of the run asks for, which is not kCandidates. setup must outlive it. Throws the
// errors of base/errors.h.
std::unique_ptr<RunVerification> MakeRunVerification(RunSetup& setup);

}  // namespace colmap_graphmatch
