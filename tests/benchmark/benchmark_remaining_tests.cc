// benchmark_remaining_tests OPTIONS of graphmatch_matcher, --GraphMatching.replay_path among them:
// how many tests were expected to come, and how many came, at shares of all tests of the run.

#include <fmt/format.h>

#include <cstddef>
#include <exception>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/cli/options.h"
#include "colmap_graphmatch/colmap_graphmatch.h"

namespace colmap_graphmatch {
namespace {

// What was expected after each test.
class ExpectationRecorder : public PipelineObserver {
 public:
  void OnInfo(const std::string& /*message*/) override {}
  void OnWarning(const std::string& /*message*/) override {}
  void OnProgress(const LoopProgress& progress) override {
    expected.push_back(progress.expected_remaining_tests);
  }

  std::vector<std::size_t> expected;
};

void Run(int argc, const char* const* argv) {
  ExpectationRecorder recorder;
  RunPipeline(ParseCommandLine(argc, argv).pipeline, StopRequest(), recorder);
  const std::size_t num_tests = recorder.expected.size();
  fmt::print("{} tests\n\n| tested | to come | expected | error |\n|---:|---:|---:|---:|\n",
             num_tests);
  for (const std::size_t percent : {5, 10, 20, 30, 40, 50, 60, 70, 80, 90}) {
    const std::size_t num_tested = num_tests * percent / 100;
    if (num_tested == 0) continue;
    const auto to_come = static_cast<double>(num_tests - num_tested);
    const auto expected = static_cast<double>(recorder.expected[num_tested - 1]);
    fmt::print("| {} % | {:.0f} | {:.0f} | {:+.0f} % |\n", percent, to_come, expected,
               100 * (expected - to_come) / to_come);
  }
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  try {
    colmap_graphmatch::Run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
