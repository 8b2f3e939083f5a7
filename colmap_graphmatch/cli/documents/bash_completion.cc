#include <map>
#include <ostream>
#include <string>

#include "colmap_graphmatch/cli/documents/documents.h"
#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {
namespace {

// What the shell does for a value; empty: nothing, it may be any number or text.
std::string Completing(const OptionRow& row) {
  if (!row.choices.empty()) {
    std::string words;
    for (const std::string& choice : row.choices) words += (words.empty() ? "" : " ") + choice;
    return "mapfile -t COMPREPLY < <(compgen -W '" + words + "' -- \"$current\")";
  }
  switch (row.path) {
    case OptionRow::Path::kFile:
      return "compopt -o default";
    case OptionRow::Path::kDirectory:
      return "compopt -o dirnames";
    case OptionRow::Path::kProgram:
      return "mapfile -t COMPREPLY < <(compgen -c -- \"$current\")";
    case OptionRow::Path::kNone:
      return "";
  }
  return "";
}

}  // namespace

void PrintBashCompletion(std::ostream& stream) {
  CommandLine defaults;
  std::string flags;
  std::string shown;
  std::string others;
  std::map<std::string, std::string> patterns;  // By what completes the value.
  for (const OptionRow& row : MakeOptionTable(&defaults)) {
    const std::string completing = Completing(row);
    std::string& pattern = row.values.empty() ? flags : patterns[completing];
    for (const std::string& name : row.names) {
      const std::string option = WithDashes(name);
      pattern += (pattern.empty() ? "" : " | ") + option;
      (row.Shows(name) ? shown : others) += "\n    " + option;
    }
  }
  patterns.erase("");
  stream << R"(# shellcheck shell=bash
# Completes the options of graphmatch_matcher and their values in bash.

_graphmatch_matcher() {
  local current=${COMP_WORDS[COMP_CWORD]} option=${COMP_WORDS[COMP_CWORD - 1]}
  # Bash takes the equals sign for a word of its own.
  if [[ $current == = ]]; then
    current=''
  elif [[ $option == = ]]; then
    option=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  COMPREPLY=()
  case $option in
    )" << flags
         << ") ;;\n";
  for (const auto& [completing, pattern] : patterns) {
    stream << "    " << pattern << ")\n      " << completing << "\n      return\n      ;;\n";
  }
  stream << R"(    --*) return ;;
  esac
  local shown=')"
         << shown << "'\n  local others='" << others << R"('
  mapfile -t COMPREPLY < <(compgen -W "$shown" -- "$current")
  if ((${#COMPREPLY[@]} == 0)); then
    mapfile -t COMPREPLY < <(compgen -W "$others" -- "$current")
  fi
}
complete -F _graphmatch_matcher graphmatch_matcher
)";
}

}  // namespace colmap_graphmatch
