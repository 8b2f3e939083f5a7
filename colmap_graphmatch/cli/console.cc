#include "colmap_graphmatch/cli/console.h"

#include <fmt/format.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/ostream_sink.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "colmap_graphmatch/cli/terminal_sink.h"

namespace colmap_graphmatch {
namespace {

constexpr std::chrono::milliseconds kFrame(100);
constexpr double kLongestFrame = 0.5;  // Seconds: the time goes on even if nothing else does.
constexpr double kLogInterval = 10;    // Seconds.
constexpr char kPattern[] = "%^%L%$%Y%m%d %T.%f %P graphmatch_matcher] %v";

bool IsSet(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

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
  sink_ = std::make_shared<TerminalSink>(stream_, kPattern, has_color_);
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
      Log(spdlog::level::info, has_progress_
                                   ? "Stopping after the pairs at work; once more gives them up."
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

}  // namespace colmap_graphmatch
