#include "colmap_graphmatch/cli/terminal_sink.h"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <memory>

namespace colmap_graphmatch {
namespace {

// Clears the line and all below it. Not in one: tmux takes what is cleared from its first line on
// to its end for a page that is worth keeping.
constexpr char kClear[] = "\033[2K\033[C\033[J\r";

// With the title bold and what is done green.
std::string Colored(std::string first_line) {
  const std::size_t bar = first_line.find(" [");
  if (bar == std::string::npos) return first_line;
  const std::size_t done_end = first_line.find_first_not_of("=>", bar + 2);
  return fmt::format("\033[1m{}\033[0m [\033[32m{}\033[0m{}", first_line.substr(0, bar),
                     first_line.substr(bar + 2, done_end - bar - 2), first_line.substr(done_end));
}

}  // namespace

TerminalSink::TerminalSink(std::FILE* stream, const std::string& pattern, bool has_color)
    : base_sink(std::make_unique<spdlog::pattern_formatter>(
          pattern, spdlog::pattern_time_type::local, "\n")),
      stream_(stream),
      has_color_(has_color) {}

void TerminalSink::ShowBlock(const ProgressView& view) {
  const Size size = TerminalSize();
  std::string back = Back(size);
  // A terminal keeps which of its rows are one wrapped line, and what is overwritten in place
  // would be joined again when it becomes wider.
  if (size.columns != columns_) back += kClear;
  columns_ = size.columns;
  // One column is left free: a full line would wrap on some terminals.
  block_ = FormatBlock(view, size.columns - 1);
  block_.resize(std::min(block_.size(), size.rows - 1));
  // Fields that are wider than the terminal are not wrapped, and must not count as if they were.
  for (std::string& line : block_) line.resize(std::min(line.size(), size.columns - 1));
  Write(back + Block());
}

void TerminalSink::EraseBlock() {
  if (block_.empty()) return;
  const std::string back = Back(TerminalSize());
  block_.clear();
  Write(back + kClear);
}

void TerminalSink::sink_it_(const spdlog::details::log_msg& message) {
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
  Write(Back(TerminalSize()) + kClear + line + Block());
}

TerminalSink::Size TerminalSink::TerminalSize() const {
  struct winsize size = {};
  Size found;
  if (::ioctl(::fileno(stream_), TIOCGWINSZ, &size) != 0) return found;
  if (size.ws_col > 0) found.columns = size.ws_col;
  if (size.ws_row > 0) found.rows = size.ws_row;
  return found;
}

// To the first column of the block. Lines that are longer than the terminal is wide by now have
// been wrapped.
std::string TerminalSink::Back(const Size& size) const {
  std::size_t num_rows = 0;
  for (const std::string& line : block_) {
    num_rows += std::max<std::size_t>((line.size() + size.columns - 1) / size.columns, 1);
  }
  return num_rows == 0 ? "\r" : fmt::format("\r\033[{}A", num_rows);
}

// The cursor is left below it, where Ctrl-C shows its ^C. Nothing is wrapped (?7l): if the terminal
// is narrower by now than it says, the block has as many rows all the same as Back() counts.
std::string TerminalSink::Block() const {
  std::string text = "\033[?7l";
  for (const std::string& line : block_) {
    const bool is_first = &line == &block_.front();
    text += (has_color_ && is_first ? Colored(line) : line) + "\033[K\n";
  }
  return text + "\033[J\033[?7h";
}

void TerminalSink::Write(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stream_);
  std::fflush(stream_);
}

}  // namespace colmap_graphmatch
