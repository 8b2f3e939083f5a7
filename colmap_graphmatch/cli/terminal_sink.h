#pragma once

#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "colmap_graphmatch/cli/progress.h"

namespace colmap_graphmatch {

// The lines of the log and, below them, the block, which is rewritten in place. Everything that
// changes the screen is one write. Not thread-safe.
class TerminalSink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  // pattern: spdlog's, of the lines.
  TerminalSink(std::FILE* stream, const std::string& pattern, bool has_color);

  // Shows this instead of what is shown.
  void ShowBlock(const ProgressView& view);

  void EraseBlock();

  // The block that is shown belongs to what was written before.
  void LeaveBlock() { block_.clear(); }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}

 private:
  struct Size {
    std::size_t columns = 80;
    std::size_t rows = 24;
  };

  Size TerminalSize() const;
  std::string Back(const Size& size) const;
  std::string Block() const;
  void Write(const std::string& text);

  std::FILE* stream_;
  bool has_color_;
  std::vector<std::string> block_;  // As it is shown, without colours.
  std::size_t columns_ = 0;         // Of the terminal when it was drawn.
};

}  // namespace colmap_graphmatch
