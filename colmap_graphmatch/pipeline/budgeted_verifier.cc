#include "colmap_graphmatch/pipeline/budgeted_verifier.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace colmap_graphmatch {
namespace {

// Pairs that are tested between two looks at the clock: a share of what fits into the time left,
// so that chunks are large at first (images are read once a chunk) and small in the end,
constexpr double kShareOfTimeLeft = 0.25;
// but enough for every thread to have something to do.
constexpr std::size_t kMinPairsPerThread = 64;  // A shard at least.
constexpr std::size_t kMaxChunk = 65536;

}  // namespace

BudgetedVerifier::BudgetedVerifier(PairVerifier& verifier, const TestBudget& budget,
                                   int num_threads, std::function<double()> seconds, Order order)
    : verifier_(verifier),
      budget_(budget),
      min_chunk_(kMinPairsPerThread * static_cast<std::size_t>(std::max(num_threads, 1))),
      seconds_(std::move(seconds)),
      order_(std::move(order)) {
  budget_.Check();
}

void BudgetedVerifier::SortByPromise(std::vector<ImagePair>* pairs) const {
  if (!order_) return;
  std::vector<std::pair<double, ImagePair>> ranked;
  ranked.reserve(pairs->size());
  for (const ImagePair& pair : *pairs) ranked.emplace_back(order_(pair), pair);
  std::sort(ranked.begin(), ranked.end());
  std::transform(ranked.begin(), ranked.end(), pairs->begin(),
                 [](const auto& entry) { return entry.second; });
}

bool BudgetedVerifier::Verify(const std::vector<ImagePair>& pairs,
                              const std::function<void(const VerifiedPair&)>& on_verified) {
  // The verifier makes of a whole batch what it would make of it in a run without interruptions.
  if (budget_.IsUnlimited()) return verifier_.Verify(pairs, on_verified);
  std::vector<ImagePair> known;
  std::vector<ImagePair> unknown;
  for (const ImagePair& pair : pairs) {
    (FindPair(KnownPairs(), pair) != nullptr ? known : unknown).push_back(pair);
  }
  const std::size_t num_left =
      budget_.max_pairs > 0 ? budget_.max_pairs - num_tested_ : unknown.size();
  const bool is_cut = unknown.size() > num_left;
  if (is_cut) {
    SortByPromise(&unknown);
    unknown.resize(num_left);
    std::sort(unknown.begin(), unknown.end());
  }
  const auto count = [&](const VerifiedPair& verified) {
    if (!verified.is_known) ++num_tested_;
    on_verified(verified);
  };
  if (!is_cut && budget_.max_minutes <= 0) return verifier_.Verify(pairs, count);
  if (!known.empty() && !verifier_.Verify(known, on_verified)) return false;
  if (!unknown.empty() && !VerifyInTime(std::move(unknown), count)) return false;
  if (is_cut) reached_ = Limit::kMaxPairs;
  return !is_cut;
}

bool BudgetedVerifier::VerifyInTime(std::vector<ImagePair> pairs,
                                    const std::function<void(const VerifiedPair&)>& on_verified) {
  if (budget_.max_minutes <= 0) return verifier_.Verify(pairs, on_verified);
  SortByPromise(&pairs);
  for (std::size_t first = 0; first < pairs.size();) {
    const double start = seconds_();
    const double left = 60 * budget_.max_minutes - start;
    std::size_t size = min_chunk_;
    if (seconds_per_pair_ > 0) {
      const double fitting = kShareOfTimeLeft * left / seconds_per_pair_;
      size = static_cast<std::size_t>(
          std::clamp(fitting, static_cast<double>(min_chunk_), static_cast<double>(kMaxChunk)));
    }
    size = std::min(size, pairs.size() - first);
    if (left <= 0 || seconds_per_pair_ * static_cast<double>(size) > left) {
      reached_ = Limit::kMaxMinutes;
      return false;
    }
    const auto begin = pairs.begin() + static_cast<std::ptrdiff_t>(first);
    std::vector<ImagePair> chunk(begin, begin + static_cast<std::ptrdiff_t>(size));
    std::sort(chunk.begin(), chunk.end());
    if (!verifier_.Verify(chunk, on_verified)) return false;
    seconds_per_pair_ = (seconds_() - start) / static_cast<double>(size);
    first += size;
  }
  return true;
}

}  // namespace colmap_graphmatch
