#include "colmap_graphmatch/verification/fault_isolation.h"

#include <cstddef>
#include <string>
#include <utility>

namespace colmap_graphmatch {
namespace {

// On the same pairs before they are split or given up.
constexpr int kTries = 2;

}  // namespace

void VerifyAndIsolate(GeometryVerifier& verifier, const std::vector<PairToVerify>& pairs,
                      ShardRunner::Progress& progress) {
  std::string problem;
  for (int i = 0; i < kTries; ++i) {
    if (progress.GivesUp()) return;
    ShardOutcome outcome = verifier.Verify(pairs, [&] { return progress.GivesUp(); });
    if (outcome.stopped) return;
    if (outcome.problem.empty()) {
      progress.Finish({std::move(outcome.results), {}, outcome.asked_colmap});
      return;
    }
    problem = std::move(outcome.problem);
  }
  if (pairs.size() == 1) {
    progress.Finish({{}, {{pairs.front().pair, problem}}});
    return;
  }
  const auto middle = pairs.begin() + static_cast<std::ptrdiff_t>(pairs.size() / 2);
  VerifyAndIsolate(verifier, {pairs.begin(), middle}, progress);
  VerifyAndIsolate(verifier, {middle, pairs.end()}, progress);
}

}  // namespace colmap_graphmatch
