#pragma once

#include <iosfwd>
#include <string>

namespace colmap_graphmatch {

// What is written about the options when the program is built, each from the table of options.

// docs/options.md.
void PrintOptionsPage(std::ostream& stream);

// graphmatch_matcher(1), in the man macros of roff. date: of the page, e.g. 2026-01-31.
void PrintManPage(std::ostream& stream, const std::string& date);

// They offer an option by the name that the help shows. Where no such name begins with what was
// typed, they offer the other names and the options without effect.
void PrintBashCompletion(std::ostream& stream);
void PrintZshCompletion(std::ostream& stream);

}  // namespace colmap_graphmatch
