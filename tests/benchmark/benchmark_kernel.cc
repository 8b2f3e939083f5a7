// benchmark_kernel [FEATURES [RUNS]]: how near exact matching comes to what a core can do. First
// the peak rates of its multiply-add instructions, measured here, then those of ComputeTopTwo with
// every instruction set, for FEATURES x FEATURES descriptors (5,800), the top two of rows and
// columns included. Medians of RUNS (5) runs; peaks and kernels take turns.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/matching/top_two.h"
#include "tests/support/matching_targets.h"

namespace colmap_graphmatch {
namespace {

// Of a kernel, in each run.
constexpr double kSeconds = 0.2;

// A loop of num steps of multiply-adds on independent sums, with everything in registers; returns
// the multiplications a step.
struct Peak {
  const char* name;
  const char* target;  // The name of the kernel that is compared with it.
  std::function<double(std::int64_t num)> run;
};

#if HWY_ARCH_X86_64
#define GRAPHMATCH_REPEAT_12(f) f(0) f(1) f(2) f(3) f(4) f(5) f(6) f(7) f(8) f(9) f(10) f(11)
#define GRAPHMATCH_LOOP(instruction) \
  asm volatile("1:\n\t" GRAPHMATCH_REPEAT_12(instruction) "dec %0\n\t"                 \
                                                          "jnz 1b\n\tvzeroupper"      \
               : "+r"(num)                                                             \
               :                                                                       \
               : "cc", "xmm0", "xmm1", "xmm2", "xmm3", "xmm4", "xmm5", "xmm6", "xmm7", \
                 "xmm8", "xmm9", "xmm10", "xmm11", "xmm12", "xmm13", "xmm15")
#define GRAPHMATCH_FMA(k) "vfmadd231ps %%ymm12, %%ymm13, %%ymm" #k "\n\t"
#define GRAPHMATCH_MADD(k)                 \
  "vpmaddwd %%ymm12, %%ymm13, %%ymm15\n\t" \
  "vpaddd %%ymm15, %%ymm" #k ", %%ymm" #k "\n\t"
#define GRAPHMATCH_WIDE_MADD(k)            \
  "vpmaddwd %%zmm12, %%zmm13, %%zmm15\n\t" \
  "vpaddd %%zmm15, %%zmm" #k ", %%zmm" #k "\n\t"
#define GRAPHMATCH_VEX_DOT(k) "%{vex%} vpdpbusd %%ymm12, %%ymm13, %%ymm" #k "\n\t"
#define GRAPHMATCH_DOT(k) "vpdpbusd %%zmm12, %%zmm13, %%zmm" #k "\n\t"

// Registers are zeroed: what they happen to contain could be slow to add up.
double FloatPeak(std::int64_t num) {
  asm volatile("vzeroall" ::
                   : "xmm0", "xmm1", "xmm2", "xmm3", "xmm4", "xmm5", "xmm6", "xmm7", "xmm8", "xmm9",
                     "xmm10", "xmm11", "xmm12", "xmm13", "xmm14", "xmm15");
  GRAPHMATCH_LOOP(GRAPHMATCH_FMA);
  return 12 * 8;
}
double Int16Peak(std::int64_t num) {
  GRAPHMATCH_LOOP(GRAPHMATCH_MADD);
  return 12 * 16;
}
double WideInt16Peak(std::int64_t num) {
  GRAPHMATCH_LOOP(GRAPHMATCH_WIDE_MADD);
  return 12 * 32;
}
double VexInt8Peak(std::int64_t num) {
  GRAPHMATCH_LOOP(GRAPHMATCH_VEX_DOT);
  return 12 * 32;
}
double Int8Peak(std::int64_t num) {
  GRAPHMATCH_LOOP(GRAPHMATCH_DOT);
  return 12 * 64;
}

std::vector<Peak> Peaks() {
  return {{"float FMA, 256 bits", "AVX2", FloatPeak},
          {"int16 multiply-add and add, 256 bits", "AVX2", Int16Peak},
          {"int16 multiply-add and add, 512 bits", "AVX-512", WideInt16Peak},
          {"int8 dot product (VNNI), 256 bits", "AVX2 with VNNI", VexInt8Peak},
          {"int8 dot product (VNNI), 512 bits", "AVX-512 with VNNI", Int8Peak}};
}
#else
std::vector<Peak> Peaks() { return {}; }
#endif

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void Main(std::size_t num_features, int num_runs) {
  std::vector<Peak> peaks;
  const std::vector<MatchingTarget> targets = MatchingTargets();
  for (const Peak& peak : Peaks()) {
    // An instruction that this processor does not have must not be tried.
    if (std::any_of(targets.begin(), targets.end(),
                    [&](const MatchingTarget& target) { return target.Name() == peak.target; })) {
      peaks.push_back(peak);
    }
  }
  Random random({1});
  std::vector<std::uint8_t> a(num_features * kDescriptorDim);
  std::vector<std::uint8_t> b(a.size());
  for (std::uint8_t& entry : a) entry = static_cast<std::uint8_t>(random.Index(256));
  for (std::uint8_t& entry : b) entry = static_cast<std::uint8_t>(random.Index(256));

  std::vector<std::vector<double>> peak_rates(peaks.size());
  std::vector<std::vector<double>> kernel_rates(targets.size());
  TopTwoBuffers buffers;
  TopTwo result;
  for (int run = 0; run <= num_runs; ++run) {
    for (std::size_t i = 0; i < peaks.size(); ++i) {
      constexpr std::int64_t kSteps = 20000000;
      const Stopwatch stopwatch;
      const double products = peaks[i].run(kSteps) * kSteps;
      if (run > 0) peak_rates[i].push_back(products / stopwatch.Seconds());
    }
    for (std::size_t i = 0; i < targets.size(); ++i) {
      targets[i].Use();
      // For some time: a processor takes a while to settle on the clock for its widest vectors.
      const Stopwatch stopwatch;
      double products = 0;
      do {
        ComputeTopTwo({a.data(), num_features}, {b.data(), num_features}, &buffers, &result);
        products += static_cast<double>(num_features * num_features);
      } while (stopwatch.Seconds() < kSeconds);
      // The first run warms up.
      if (run > 0) kernel_rates[i].push_back(products * kDescriptorDim / stopwatch.Seconds());
    }
  }
  MatchingTarget().Use();

  fmt::print("peak                                     G multiply-adds/s\n");
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    fmt::print("{:<40} {:>17.1f}\n", peaks[i].name, Median(peak_rates[i]) / 1e9);
  }
  fmt::print("\n{} x {} descriptors   G multiply-adds/s   seconds   of the peak\n", num_features,
             num_features);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const double rate = Median(kernel_rates[i]);
    double peak = 0;
    for (std::size_t p = 0; p < peaks.size(); ++p) {
      if (peaks[p].target == targets[i].Name()) peak = std::max(peak, Median(peak_rates[p]));
    }
    const auto products = static_cast<double>(num_features * num_features);
    fmt::print("{:<26} {:>17.1f} {:>9.4f} {:>13}\n", targets[i].Name(), rate / 1e9,
               products * kDescriptorDim / rate,
               peak > 0 ? fmt::format("{:.1f} %", 100 * rate / peak) : "-");
  }
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  colmap_graphmatch::Main(argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 5800,
                          std::max(1, argc > 2 ? std::atoi(argv[2]) : 5));
  return 0;
}
