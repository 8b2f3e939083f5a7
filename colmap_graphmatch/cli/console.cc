#include "colmap_graphmatch/cli/console.h"

#include <fmt/format.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/logger.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/ostream_sink.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

constexpr std::chrono::milliseconds kFrame(100);
constexpr double kLongestFrame = 0.5;  // Seconds: the time goes on even if nothing else does.
constexpr double kLogInterval = 10;    // Seconds.
constexpr char kPattern[] = "%^%L%$%Y%m%d %T.%f %P graphmatch_matcher] %v";

// Clears the line and all below it. Not in one: tmux takes what is cleared from its first line on
// to its end for a page that is worth keeping.
constexpr char kClear[] = "\033[2K\033[C\033[J\r";

struct TerminalSize {
  std::size_t columns = 80;
  std::size_t rows = 24;
};

TerminalSize SizeOf(int descriptor) {
  struct winsize size = {};
  TerminalSize found;
  if (::ioctl(descriptor, TIOCGWINSZ, &size) != 0) return found;
  if (size.ws_col > 0) found.columns = size.ws_col;
  if (size.ws_row > 0) found.rows = size.ws_row;
  return found;
}

bool IsSet(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

// With the title bold and what is done green.
std::string Colored(std::string first_line) {
  const std::size_t bar = first_line.find(" [");
  if (bar == std::string::npos) return first_line;
  const std::size_t done_end = first_line.find_first_not_of("=>", bar + 2);
  return fmt::format("\033[1m{}\033[0m [\033[32m{}\033[0m{}", first_line.substr(0, bar),
                     first_line.substr(bar + 2, done_end - bar - 2), first_line.substr(done_end));
}

double Share(std::size_t part, double whole) {
  return whole > 0 ? 100 * static_cast<double>(part) / whole : 0;
}

std::string FormatStage(const char* name, const StageStatistics& stage) {
  const std::string efficiency =
      stage.num_tested > 0 ? fmt::format("{:.3f}", stage.Efficiency()) : "-";
  std::string line =
      fmt::format("  {:<12} {:>9} tested {:>9} edges   efficiency {:<5} {:>12}", name,
                  stage.num_tested, stage.num_edges, efficiency, FormatDuration(stage.seconds));
  if (stage.num_known > 0) {
    line +=
        fmt::format("   ({} more were known, {} edges)", stage.num_known, stage.num_known_edges);
  }
  return line + "\n";
}

// Where the time of matching went.
std::string FormatVerification(const PipelineResult& result) {
  const MatchingStatistics& matching = result.descriptor_matching;
  const ColmapVerifier::Statistics& colmap = result.colmap;
  std::string text;
  if (matching.num_matched > 0) {
    text += fmt::format(
        "Exact matching     {} pairs in {} of CPU time, {:.3f} image reads a pair\n",
        matching.num_matched, FormatDuration(matching.seconds),
        static_cast<double>(matching.num_image_reads) / static_cast<double>(matching.num_matched));
  }
  const double both = matching.seconds + colmap.seconds;
  if (both > 0) {
    text += fmt::format(
        "COLMAP             {} pairs in {}, summed over its processes: {:.0f} % of {}\n",
        colmap.num_verified, FormatDuration(colmap.seconds), 100 * colmap.seconds / both,
        "matching and verification");
  }
  return text;
}

std::string FormatImages(const PipelineResult& result) {
  std::string text = fmt::format("\nImages             {}", result.num_images);
  if (result.num_images_without_features > 0) {
    text += fmt::format(" ({} without features)", result.num_images_without_features);
  }
  return text + "\n";
}

std::string FormatDryRun(const PipelineResult& result) {
  std::string text = FormatImages(result);
  text += fmt::format(
      "Candidates         {} pairs that are not tested yet: each image with its {}\n",
      result.candidates.size(), fmt::format("{} nearest", result.num_candidates_per_image));
  text += "Dry run            nothing was tested, and nothing written to the database\n";
  text += fmt::format("Time               {}\n", FormatDuration(result.total_seconds));
  return text;
}

std::string FormatStoppedBy(const PipelineOptions& options, const PipelineResult& result) {
  std::string limit;
  switch (result.stopped_by) {
    case PipelineResult::StoppedBy::kNothing:
      return "";
    case PipelineResult::StoppedBy::kRequest:
      limit = "as asked";
      break;
    case PipelineResult::StoppedBy::kMaxPairs:
      limit = fmt::format("after max_pairs = {}", options.budget.max_pairs);
      break;
    case PipelineResult::StoppedBy::kMaxMinutes:
      limit = fmt::format("by max_minutes = {:g}", options.budget.max_minutes);
      break;
  }
  const std::string left =
      result.num_expected_tests_left
          ? fmt::format("about {} more tests were to come", *result.num_expected_tests_left)
          : std::string("before the first test");
  return fmt::format("Stopped            {}; {}\n", limit, left);
}

}  // namespace

// The lines of the log and, below them, the block, which is rewritten in place. Everything that
// changes the screen is one write.
class Console::TerminalSink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  TerminalSink(std::FILE* stream, bool has_color)
      : base_sink(std::make_unique<spdlog::pattern_formatter>(
            kPattern, spdlog::pattern_time_type::local, "\n")),
        stream_(stream),
        has_color_(has_color) {}

  // Shows this instead of what is shown. One column is left free: a full line would wrap on some
  // terminals.
  void ShowBlock(const ProgressView& view) {
    const TerminalSize size = SizeOf(::fileno(stream_));
    std::string back = Back(size);
    // A terminal keeps which of its rows are one wrapped line, and what is overwritten in place
    // would be joined again when it becomes wider.
    if (size.columns != columns_) back += kClear;
    columns_ = size.columns;
    block_ = FormatBlock(view, size.columns - 1);
    block_.resize(std::min(block_.size(), size.rows - 1));
    // Fields that are wider than the terminal are not wrapped, and must not count as if they were.
    for (std::string& line : block_) line.resize(std::min(line.size(), size.columns - 1));
    Write(back + Block());
  }

  void EraseBlock() {
    if (block_.empty()) return;
    const std::string back = Back(SizeOf(::fileno(stream_)));
    block_.clear();
    Write(back + kClear);
  }

  // The block that is shown belongs to what was written before.
  void LeaveBlock() { block_.clear(); }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t formatted;
    formatter_->format(message, formatted);
    std::string line = fmt::to_string(formatted);
    if (has_color_ && message.level >= spdlog::level::warn) {
      const char* color = message.level == spdlog::level::warn ? "\033[33m" : "\033[31m";
      line.insert(message.color_range_end, "\033[0m");
      line.insert(message.color_range_start, color);
    }
    if (block_.empty()) {
      Write(line);
      return;
    }
    Write(Back(SizeOf(::fileno(stream_))) + kClear + line + Block());
  }

  void flush_() override {}

 private:
  // To the first column of the block. Lines that are longer than the terminal is wide by now have
  // been wrapped.
  std::string Back(const TerminalSize& size) const {
    std::size_t num_rows = 0;
    for (const std::string& line : block_) {
      num_rows += std::max<std::size_t>((line.size() + size.columns - 1) / size.columns, 1);
    }
    return num_rows == 0 ? "\r" : fmt::format("\r\033[{}A", num_rows);
  }

  // The cursor is left below it, where Ctrl-C shows its ^C. Nothing is wrapped (?7l): if the
  // terminal is narrower by now than it says, the block has as many rows all the same as Back()
  // counts.
  std::string Block() const {
    std::string text = "\033[?7l";
    for (const std::string& line : block_) {
      const bool is_first = &line == &block_.front();
      text += (has_color_ && is_first ? Colored(line) : line) + "\033[K\n";
    }
    return text + "\033[J\033[?7h";
  }

  void Write(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stream_);
    std::fflush(stream_);
  }

  std::FILE* stream_;
  bool has_color_;
  std::vector<std::string> block_;  // As it is shown, without colours.
  std::size_t columns_ = 0;         // Of the terminal when it was drawn.
};

namespace {

spdlog::level::level_enum LevelOf(const LogOptions& options) {
  const int severity = std::max(options.severity, options.quiet ? 1 : 0);
  if (severity == 0) return spdlog::level::info;
  return severity == 1 ? spdlog::level::warn : spdlog::level::err;
}

std::unique_ptr<spdlog::logger> MakeFileLog(std::ostream& file) {
  auto sink = std::make_shared<spdlog::sinks::ostream_sink_st>(file);
  auto log = std::make_unique<spdlog::logger>("file", std::move(sink));
  log->set_pattern(kPattern);
  log->flush_on(spdlog::level::info);
  return log;
}

}  // namespace

Console::Console(const LogOptions& options)
    : options_(options), stream_(options.target == LogOptions::Target::kStdout ? stdout : stderr) {
  const int descriptor = ::fileno(stream_);
  const char* terminal = std::getenv("TERM");
  const bool is_terminal =
      ::isatty(descriptor) == 1 && terminal != nullptr && std::strcmp(terminal, "dumb") != 0;
  has_color_ = is_terminal && options.color && !IsSet("NO_COLOR");
  const bool only_file = options.target == LogOptions::Target::kFile;
  has_block_ = is_terminal && !options.quiet && !only_file;
  sink_ = std::make_shared<TerminalSink>(stream_, has_color_);
  terminal_log_ = std::make_unique<spdlog::logger>("terminal", sink_);
  terminal_log_->set_level(only_file ? spdlog::level::err : LevelOf(options));
  const std::filesystem::path path = options.FilePath();
  if (!path.empty()) {
    file_ = std::make_unique<GrowingFile>(path, GrowingFile::Mode::kAppend);
    file_log_ = MakeFileLog(*file_);
    file_log_->set_level(LevelOf(options));
  }
  watcher_ = std::make_unique<ThreadGroup>(1, [this] { Watch(); });
  if (watcher_->Size() == 0) has_block_ = false;
}

Console::~Console() {
  EndProgress();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  ended_.notify_one();
  watcher_->Join();
}

void Console::OnInfo(const std::string& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Log(spdlog::level::info, message);
}

void Console::OnWarning(const std::string& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Log(spdlog::level::warn, message);
}

void Console::Error(const std::string& message) {
  EndProgress();
  const std::lock_guard<std::mutex> lock(mutex_);
  Log(spdlog::level::err, message);
}

void Console::OnProgress(const LoopProgress& progress) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_first = !has_progress_;
  if (is_first) start_ = Clock::now();
  if (!is_first &&
      (progress.stage != progress_.stage || progress.iteration != progress_.iteration)) {
    LogStage();
    before_stage_ = progress_.all;
  }
  has_progress_ = true;
  progress_ = progress;
  is_drawn_current_ = false;
  const double seconds = Seconds();
  rate_.Update(seconds, progress.all.num_tested);
  time_left_.Update(seconds, progress);
  if (is_first) Draw(seconds);
}

void Console::EndProgress() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (has_progress_) LogStage();
  has_progress_ = false;
  sink_->EraseBlock();
}

void Console::Log(int level, const std::string& message, bool on_terminal) {
  const std::string text = WithoutControlCharacters(message);
  const spdlog::log_clock::time_point now = spdlog::log_clock::now();
  const auto severity = static_cast<spdlog::level::level_enum>(level);
  if (on_terminal) terminal_log_->log(now, spdlog::source_loc(), severity, text);
  if (!file_log_) return;
  file_log_->log(now, spdlog::source_loc(), severity, text);
  if (file_->Error() == 0 || std::exchange(said_log_fails_, true)) return;
  // Whatever else is not to be said there: nobody could know otherwise.
  terminal_log_->log(now, spdlog::source_loc(),
                     std::max(spdlog::level::warn, terminal_log_->level()),
                     fmt::format("The log {} cannot be written any more: {}. The run goes on.",
                                 options_.FilePath().string(), std::strerror(file_->Error())));
}

void Console::LogStage() {
  // Files of options that COLMAP 3.8 writes have 2.
  if (options_.verbosity < 3) return;
  const ProgressView view = View(0);
  Log(spdlog::level::info, fmt::format("{} ended: {} pairs tested, {} edges",
                                       StageTitle(progress_.stage, progress_.iteration),
                                       view.num_tested_now, view.num_edges_now));
}

void Console::Watch() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ended_.wait_for(lock, kFrame, [this] { return ends_; })) {
    if (interrupted_ && !said_interrupted_) {
      said_interrupted_ = true;
      Log(spdlog::level::info,
          has_progress_
              ? "Stopping after the pairs that COLMAP is working on; once more gives them up."
              : "Stopping.");
    }
    if (!has_progress_) continue;
    const double seconds = Seconds();
    LogProgressIfDue(seconds);
    if (!is_drawn_current_ || seconds - last_drawn_ >= kLongestFrame) Draw(seconds);
  }
}

void Console::LogProgressIfDue(double seconds) {
  if (seconds < next_logged_ || options_.quiet) return;
  while (next_logged_ <= seconds) {
    next_logged_ = next_logged_ == 1   ? 2
                   : next_logged_ == 2 ? 5
                   : next_logged_ == 5 ? kLogInterval
                                       : next_logged_ + kLogInterval;
  }
  Log(spdlog::level::info, FormatProgress(View(seconds)), !has_block_ || !OwnsScreen());
}

void Console::Draw(double seconds) {
  if (!has_block_) return;
  if (continued_.exchange(false)) sink_->LeaveBlock();
  if (!OwnsScreen()) return;
  sink_->ShowBlock(View(seconds));
  last_drawn_ = seconds;
  is_drawn_current_ = true;
}

// In the background the screen is another program's. A terminal that is not the one that controls
// this process (after setsid) has nobody else.
bool Console::OwnsScreen() const {
  const pid_t foreground = ::tcgetpgrp(::fileno(stream_));
  return foreground == ::getpgrp() || foreground < 0;
}

double Console::Seconds() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

ProgressView Console::View(double seconds) const {
  ProgressView view;
  view.loop = progress_;
  view.num_tested_now = progress_.all.num_tested - before_stage_.num_tested;
  view.num_edges_now = progress_.all.num_edges - before_stage_.num_edges;
  view.rate = rate_.At(seconds);
  view.seconds_left = time_left_.At(seconds);
  view.seconds = seconds;
  return view;
}

std::string WithoutControlCharacters(std::string text) {
  const auto is_control = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < ' ' && c != '\n' && c != '\t') || byte == 0x7F;
  };
  std::replace_if(text.begin(), text.end(), is_control, '?');
  // U+0080 to U+009F in UTF-8: to some terminals U+009B is what ESC [ is.
  for (std::size_t i = text.find('\xC2'); i != std::string::npos; i = text.find('\xC2', i + 1)) {
    if (i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0) {
      text.replace(i, 2, "?");
    }
  }
  return text;
}

std::string FormatSummary(const PipelineOptions& options, const PipelineResult& result) {
  if (result.dry_run) return FormatDryRun(result);
  const ExplorationResult& matching = result.matching;
  const auto num_images =
      static_cast<double>(result.num_images - result.num_images_without_features);
  const double num_possible = num_images * (num_images - 1) / 2;
  const StageStatistics all = matching.stages.All();
  const bool listed = result.listed;

  std::string text = FormatImages(result);
  text += fmt::format("Pairs tested       {} of {:.0f} possible ({:.2f} %)\n", all.num_tested,
                      num_possible, Share(all.num_tested, num_possible));
  if (matching.num_seed_pairs > 0) {
    text += fmt::format("Already there      {} pairs{}, {} edges\n", matching.num_seed_pairs,
                        listed ? " that are not listed" : "", matching.num_seed_edges);
  }
  for (const LoopStage stage : kLoopStages) {
    const StageStatistics& statistics = matching.stages[stage];
    const bool is_empty = statistics.num_tested + statistics.num_failed + statistics.num_known == 0;
    // Of listed pairs the sum says all.
    if (is_empty || stage == LoopStage::kListed) continue;
    text += FormatStage(StageName(stage), statistics);
  }
  text += FormatStage("all", all);
  if (all.num_tested + all.num_failed == 0 && matching.finished) {
    text +=
        "  Nothing is left to test: all pairs that these options ask for were tested before, "
        "perhaps "
        "with other\n  options of matching. To match anew: colmap database_cleaner --type matches "
        "--database_path DATABASE\n";
  }
  text +=
      fmt::format("Matching graph     {} edges, {} components, the largest of {} images\n",
                  matching.graph.NumEdges(), matching.num_components, matching.largest_component);
  text += fmt::format("Without an edge    {} images\n",
                      matching.num_isolated + result.num_images_without_features);
  text += FormatStoppedBy(options, result);
  if (!matching.failed_pairs.empty()) {
    text += fmt::format("Failed             {} pairs, see the warnings; they stay untested\n",
                        matching.failed_pairs.size());
  }
  text += FormatVerification(result);
  if (result.replayed) {
    text += fmt::format("Replayed           matching and verification would have taken some {}\n",
                        FormatDuration(result.modelled_seconds));
  }
  text += fmt::format("Time               {}", FormatDuration(result.total_seconds));
  if (!listed) {
    const ImageRankingSeconds& seconds = result.preprocessing_seconds;
    text += " (";
    if (seconds.mixture > 0) text += fmt::format("mixture {}, ", FormatDuration(seconds.mixture));
    if (options.ranking.ranking_path.empty()) {
      text += fmt::format("{} {}, ", NameOfVectors(options.ranking.vectors.descriptor),
                          FormatDuration(seconds.vectors));
    }
    text += fmt::format("ranking {}, matching {})", FormatDuration(seconds.ranking),
                        FormatDuration(result.matching_seconds));
  }
  text += '\n';
  return text;
}

}  // namespace colmap_graphmatch
