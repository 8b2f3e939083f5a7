#include <ostream>
#include <string>

#include "colmap_graphmatch/cli/documents/documents.h"
#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {
namespace {

// With a backslash before each of `special`, and so that it can stand between single quotes.
std::string Quoted(const std::string& text, const std::string& special) {
  std::string quoted;
  for (const char c : text) {
    if (special.find(c) != std::string::npos) quoted += '\\';
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return quoted;
}

// What completes the value, as _arguments calls an action.
std::string Action(const OptionRow& row) {
  if (!row.choices.empty()) {
    std::string words;
    for (const std::string& choice : row.choices) words += (words.empty() ? "" : " ") + choice;
    return "(" + words + ")";
  }
  switch (row.path) {
    case OptionRow::Path::kFile:
      return "_files";
    case OptionRow::Path::kDirectory:
      return "_files -/";
    case OptionRow::Path::kProgram:
      return "{_command_names -e || _files}";
    case OptionRow::Path::kNone:
      return " ";
  }
  return " ";
}

// One option under one of its names, as _arguments takes it.
std::string Specification(const OptionRow& row, const std::string& name) {
  std::string excluded;
  for (const std::string& other : row.names) {
    excluded += (excluded.empty() ? "" : " ") + WithDashes(other);
  }
  std::string text = "'(" + excluded + ")" + WithDashes(name);
  if (!row.values.empty()) text += '=';
  const bool is_unused = row.use == OptionRow::Use::kUnused;
  text += "[" + Quoted((is_unused ? "no effect: " : "") + row.help, "[]\\") + "]";
  if (!row.values.empty()) text += ":" + Quoted(row.values, ":\\") + ":" + Action(row);
  return text + "'";
}

}  // namespace

void PrintZshCompletion(std::ostream& stream) {
  CommandLine defaults;
  std::string shown;
  std::string others;
  for (const OptionRow& row : MakeOptionTable(&defaults)) {
    for (const std::string& name : row.names) {
      const std::string line = "\n  " + Specification(row, name);
      (row.Shows(name) ? shown : others) += line;
    }
  }
  stream << "#compdef graphmatch_matcher\n"
            "# Completes the options of graphmatch_matcher and their values in zsh.\n\n"
            "local -a shown others\n"
            "shown=("
         << shown << "\n)\nothers=(" << others << "\n)\n";
  // '!': known and not offered.
  stream << R"(
_arguments "${shown[@]}" "${others[@]/#/!}" && return
[[ $PREFIX == -* ]] && _arguments "${shown[@]}" "${others[@]}"
)";
}

}  // namespace colmap_graphmatch
