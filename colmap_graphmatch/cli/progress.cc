#include "colmap_graphmatch/cli/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace colmap_graphmatch {
namespace {

constexpr double kSecondsBeforeRate = 0.5;
constexpr std::size_t kLongestBar = 40;
constexpr std::size_t kShortestBar = 8;
constexpr char kGap[] = "   ";

// The integral of exp(-t / kWindow) over the last seconds.
double WeightOf(double seconds) {
  return -RecentRate::kWindow * std::expm1(-seconds / RecentRate::kWindow);
}

std::string WithCommas(std::size_t number) {
  std::string digits = std::to_string(number);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, ",");
  return digits;
}

std::string Ratio(std::size_t part, std::size_t whole) {
  return whole == 0 ? "-"
                    : fmt::format("{:.2f}", static_cast<double>(part) / static_cast<double>(whole));
}

std::string Efficiency(const ProgressView& view) {
  return fmt::format("efficiency {} now, {} overall",
                     Ratio(view.num_edges_now, view.num_tested_now),
                     Ratio(view.loop.all.num_edges, view.loop.all.num_tested));
}

std::string Bar(double share, std::size_t length) {
  const auto done = static_cast<std::size_t>(share * static_cast<double>(length));
  std::string bar = "[" + std::string(done, '=') + std::string(length - done, ' ') + "]";
  if (done < length) bar[1 + done] = '>';
  return bar;
}

int Percent(double share) { return static_cast<int>(100 * share); }

std::string FormatTimeLeft(const ProgressView& view) {
  if (view.seconds_left < 0) return "time left: not known yet";
  const double seconds = std::ceil(view.seconds_left);
  // A guess has no decimals.
  return "about " + (seconds < 100 ? fmt::format("{:.0f} s", seconds) : FormatDuration(seconds)) +
         " left";
}

}  // namespace

void RecentRate::Update(double seconds, std::size_t total) {
  if (!begun_ || seconds - begin_ < kSecondsBeforeRate) {
    if (!begun_) begin_ = seconds;
    begun_ = true;
    last_ = seconds;
    last_total_ = total;
    return;
  }
  const double elapsed = seconds - last_;
  const double decay = std::exp(-elapsed / kWindow);
  const double weight = WeightOf(elapsed);
  // As if they had come evenly since the last time.
  weighted_count_ = weighted_count_ * decay +
                    static_cast<double>(total - last_total_) * (elapsed > 0 ? weight / elapsed : 1);
  weighted_seconds_ = weighted_seconds_ * decay + weight;
  last_ = seconds;
  last_total_ = total;
}

double RecentRate::At(double seconds) const {
  if (weighted_count_ == 0) return 0;
  const double decay = std::exp(-(seconds - last_) / kWindow);
  return weighted_count_ * decay / (weighted_seconds_ * decay + WeightOf(seconds - last_));
}

void TimeLeft::Update(double seconds, const LoopProgress& progress) {
  const double elapsed = begun_ ? seconds - last_ : 0;
  const std::size_t num_tested = progress.all.num_tested - progress_.all.num_tested;
  if (progress.stage == LoopStage::kSampling) {
    if (sampling_.empty() || sampling_.back().iteration != progress.iteration) {
      sampling_.push_back({progress.iteration, 0, 0});
      if (sampling_.size() > 3) sampling_.erase(sampling_.begin());
    }
    sampling_.back().seconds += elapsed;
    sampling_.back().num_tested += num_tested;
  } else {
    seconds_of_others_ += elapsed;
    num_others_ += num_tested;
    others_.Update(seconds_of_others_, num_others_);
  }
  begun_ = true;
  last_ = seconds;
  progress_ = progress;
}

double TimeLeft::SecondsPerSample() const {
  // A batch that has only begun says little: its first answers come late.
  std::vector<Batch> batches = sampling_;
  const auto is_fresh = [&] {
    return batches.size() > 1 &&
           2 * batches.back().num_tested < batches[batches.size() - 2].num_tested;
  };
  if (is_fresh()) batches.pop_back();
  if (batches.empty() || batches.back().num_tested == 0) return 0;
  const Batch& last = batches.back();
  if (batches.size() < 2) return last.SecondsPerTest();
  const Batch& before = batches[batches.size() - 2];
  if (before.num_tested == 0 || before.seconds <= 0) return last.SecondsPerTest();
  constexpr double kFastestDecay = 0.5;
  const double ratio =
      std::clamp(last.SecondsPerTest() / before.SecondsPerTest(), kFastestDecay, 1.0);
  // The mean of ratio, ratio^2, ... over the iterations to come.
  const double num_iterations = std::max(static_cast<double>(progress_.expected_remaining_samples) /
                                             static_cast<double>(last.num_tested),
                                         1.0);
  const double mean =
      ratio == 1 ? 1
                 : ratio * (1 - std::pow(ratio, num_iterations)) / ((1 - ratio) * num_iterations);
  return mean * last.SecondsPerTest();
}

double TimeLeft::At(double seconds) const {
  const bool samples_now = progress_.stage == LoopStage::kSampling;
  const double waiting = seconds - last_;
  const auto num_samples = static_cast<double>(progress_.expected_remaining_samples);
  const double num_others = static_cast<double>(progress_.expected_remaining_tests) - num_samples;
  const double rate = others_.At(seconds_of_others_ + (samples_now ? 0 : waiting));
  double per_other = rate > 0 ? 1 / rate : 0;
  double per_sample = SecondsPerSample();
  if (per_sample == 0) per_sample = per_other;
  if (per_other == 0) per_other = per_sample;
  return per_sample > 0 ? num_samples * per_sample + num_others * per_other : -1;
}

double ProgressView::ShareDone() const {
  const auto done = static_cast<double>(loop.all.num_tested);
  const double all = done + static_cast<double>(loop.expected_remaining_tests);
  return all > 0 ? done / all : 0;
}

std::string StageTitle(LoopStage stage, int iteration) {
  const std::string name = stage == LoopStage::kListed ? "matching" : StageName(stage);
  const bool repeats = stage != LoopStage::kListed && stage != LoopStage::kRetrieval;
  return repeats ? fmt::format("{} {}", name, iteration + 1) : name;
}

std::vector<std::string> FormatBlock(const ProgressView& view, std::size_t width) {
  const LoopProgress& loop = view.loop;
  const double share = view.ShareDone();
  const std::string title = StageTitle(loop.stage, loop.iteration);
  const std::string end = fmt::format(" {:>2} %{}{}", Percent(share), kGap, FormatTimeLeft(view));
  // Of the line the title, a space, the brackets and the end are no bar.
  const std::size_t used = title.size() + 1 + 2 + end.size();
  const std::size_t bar = width > used ? std::min(width - used, kLongestBar) : 0;
  std::vector<std::string> lines;
  lines.push_back(title + (bar >= kShortestBar ? " " + Bar(share, bar) : std::string()) + end);
  const std::string so_far = kGap + FormatDuration(view.seconds) + " so far";
  if (lines.back().size() + so_far.size() <= width) lines.back() += so_far;
  std::string line;
  for (const std::string& field :
       {WithCommas(loop.all.num_tested) + " pairs tested",
        view.rate > 0 ? fmt::format("{:.1f} pairs/s", view.rate) : std::string("- pairs/s"),
        WithCommas(loop.num_edges) + " edges", Efficiency(view),
        WithCommas(loop.num_components) + " components",
        "largest " + WithCommas(loop.largest_component) + " images",
        WithCommas(loop.num_isolated) + " images alone"}) {
    if (!line.empty() && line.size() + sizeof(kGap) - 1 + field.size() > width) {
      lines.push_back(line);
      line.clear();
    }
    line += (line.empty() ? "" : kGap) + field;
  }
  lines.push_back(line);
  return lines;
}

std::string FormatProgress(const ProgressView& view) {
  const LoopProgress& loop = view.loop;
  return fmt::format(
      "{}: {} pairs tested ({} %), {:.1f} pairs/s, {}; {} edges, {}; {} components, largest {} "
      "images, {} images alone",
      StageTitle(loop.stage, loop.iteration), loop.all.num_tested, Percent(view.ShareDone()),
      view.rate, FormatTimeLeft(view), loop.num_edges, Efficiency(view), loop.num_components,
      loop.largest_component, loop.num_isolated);
}

std::string FormatDuration(double seconds) {
  if (seconds < 100) return fmt::format("{:.1f} s", seconds);
  if (seconds < 100 * 60) return fmt::format("{:.1f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace colmap_graphmatch
