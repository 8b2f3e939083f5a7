#include <ostream>
#include <string>
#include <vector>

#include "colmap_graphmatch/cli/documents/documents.h"
#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {
namespace {

// "3.8: SiftMatching.max_error; 3.9: TwoViewGeometry.max_error"; "3.8" if it always had this name.
std::string ColmapSpellings(const OptionRow& row) {
  if (row.colmap.size() == 1 && row.colmap.front().name == row.name) {
    return ToString(row.colmap.front().first);
  }
  std::string text;
  std::string last;
  for (const ColmapSpelling& spelling : row.colmap) {
    if (spelling.name == last) continue;
    last = spelling.name;
    text += (text.empty() ? "" : "<br>") + ToString(spelling.first) + ": " +
            (last.empty() ? "gone" : "`" + last + "`");
  }
  return text;
}

// '|' would end a cell.
std::string Cell(std::string text) {
  for (std::size_t i = text.find('|'); i != std::string::npos; i = text.find('|', i + 2)) {
    text.insert(i, "\\");
  }
  return text;
}

}  // namespace

void PrintOptionsPage(std::ostream& stream) {
  stream
      << "# Options\n\n"
         "Generated from the table in `colmap_graphmatch/cli/option_table.cc`, which the program "
         "itself reads; tests hold it\nagainst what `colmap vocab_tree_matcher -h` prints.\n\n"
         "- `graphmatch_matcher -h`, or `--help`, shows the ten that are used most; `--help-all` "
         "shows all.\n"
         "- Every option of `colmap vocab_tree_matcher` of COLMAP 3.8 to 4.2 is accepted, in the "
         "spelling of any version. Those\n  of matching and verification may be given in each of "
         "the groups `SiftMatching`, `TwoViewGeometry` and\n  `FeatureMatching`. They reach COLMAP "
         "in the spelling of the installed version. What is not given keeps that COLMAP's\n  own "
         "default.\n"
         "- The same option twice, in one spelling or two, must have the same value: otherwise "
         "exit code 1.\n"
         "- An option that the installed COLMAP does not have is named in a warning. An unknown "
         "option is an error that names the\n  nearest one; in a project file it is a warning, for "
         "it may be one of a newer COLMAP. Abbreviations are taken as long as\n  only one option "
         "begins like that, as COLMAP does.\n"
         "- `--project_path` reads an ini file as COLMAP writes it (`colmap project_generator`). "
         "What is on the command line goes\n  before it; options of other commands in it are left "
         "alone; every value in it counts as given.\n"
         "- Booleans are `1` or `0`; `true`, `yes`, `on` and their opposites will do.\n";
  CommandLine defaults;
  const std::vector<OptionRow> rows = MakeOptionTable(&defaults);
  std::string section;
  std::string why_unused;
  for (const OptionRow& row : rows) {
    const bool is_unused = row.use == OptionRow::Use::kUnused;
    if (row.section != section) {
      section = row.section;
      stream << "\n## " << section << "\n\n";
      if (!is_unused) {
        stream << "| option | must be | default | what it does | in COLMAP since |\n"
                  "|---|---|---|---|---|\n";
      }
    }
    if (is_unused) {
      if (row.help != why_unused) stream << "- " << row.help << ":\n";
      why_unused = row.help;
      for (const std::string& name : row.names) stream << "  `" << name << "`\n";
      continue;
    }
    const bool here = row.use == OptionRow::Use::kOwn || row.use == OptionRow::Use::kHere;
    stream << "| `" << row.name << "` | " << Cell(row.values) << " | "
           << Cell(here ? row.default_value : row.ColmapDefaults()) << " | " << Cell(row.help)
           << " | " << ColmapSpellings(row) << " |\n";
  }
}

}  // namespace colmap_graphmatch
