#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <ostream>

#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {
namespace {

namespace po = boost::program_options;

constexpr unsigned kLineLength = 100;
constexpr unsigned kHelpLength = 50;

std::string Text(const ColmapVersion& version) {
  return fmt::format("{}.{}", version.major, version.minor);
}

// "COLMAP: 0.25; since 4.2: 0", "COLMAP since 3.13: 1", "COLMAP before 3.9: 0".
std::string ColmapDefaults(const OptionRow& row) {
  const ColmapSpelling& first = row.colmap.front();
  std::string text = "COLMAP";
  if (ColmapVersion{3, 8} < first.first) text += " since " + Text(first.first);
  if (row.colmap.back().name.empty()) text += " before " + Text(row.colmap.back().first);
  text += ": " + (first.default_value.empty() ? "none" : first.default_value);
  std::string last = first.default_value;
  for (const ColmapSpelling& spelling : row.colmap) {
    if (spelling.name.empty() || spelling.default_value == last) continue;
    last = spelling.default_value;
    text += "; since " + Text(spelling.first) + ": " + last;
  }
  return text;
}

// "3.8: SiftMatching.max_error; 3.9: TwoViewGeometry.max_error".
std::string ColmapSpellings(const OptionRow& row) {
  std::string text;
  std::string last;
  for (const ColmapSpelling& spelling : row.colmap) {
    if (spelling.name == last) continue;
    last = spelling.name;
    text += (text.empty() ? "" : "<br>") + Text(spelling.first) + ": " +
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

void PrintHelp(std::ostream& stream) {
  stream << "graphmatch_matcher --database_path DATABASE [options]\n\n"
            "Finds which images of a COLMAP database show the same place, matches them, has COLMAP "
            "verify them, and\nwrites the two-view geometries to the database, ready for `colmap "
            "mapper`. A "
            "replacement for\n`colmap vocab_tree_matcher` that needs no vocabulary tree.\n\n";
  CommandLine defaults;
  const std::vector<OptionRow> rows = MakeOptionTable(&defaults);
  for (auto row = rows.begin(); row != rows.end();) {
    if (row->use == OptionRow::Use::kUnused) {
      ++row;
      continue;
    }
    po::options_description section(row->section, kLineLength, kHelpLength);
    const std::string name = row->section;
    for (; row != rows.end() && row->section == name; ++row) {
      std::string help = row->help;
      if (row->use == OptionRow::Use::kPassedOn) help += " (" + ColmapDefaults(*row) + ")";
      const std::string spelling = row->name == "help" ? "help,h" : row->name;
      if (row->values.empty()) {
        section.add_options()(spelling.c_str(), help.c_str());
      } else if (row->default_value.empty()) {
        section.add_options()(spelling.c_str(), po::value<std::string>(), help.c_str());
      } else {
        section.add_options()(spelling.c_str(),
                              po::value<std::string>()->default_value(row->default_value),
                              help.c_str());
      }
    }
    stream << section << '\n';
  }
  stream
      << "All other options of `colmap vocab_tree_matcher` of COLMAP 3.8 to 4.2 are accepted, too, "
         "and have no effect.\n";
}

void PrintOptionsDocument(std::ostream& stream) {
  stream
      << "# Options\n\n"
         "Generated from the table in `colmap_graphmatch/cli/option_table.cc`, which the program "
         "itself reads; tests hold it\nagainst what `colmap vocab_tree_matcher -h` prints.\n\n"
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
  for (const OptionRow& row : rows) {
    if (row.section != section) {
      section = row.section;
      stream << "\n## " << section << "\n\n";
      stream << "| option | must be | default | what it does | in COLMAP since |\n"
                "|---|---|---|---|---|\n";
    }
    const bool here = row.use == OptionRow::Use::kOwn || row.use == OptionRow::Use::kHere;
    stream << "| `" << row.name << "` | " << Cell(row.values) << " | "
           << Cell(here ? row.default_value : ColmapDefaults(row)) << " | " << Cell(row.help)
           << " | " << ColmapSpellings(row) << " |\n";
  }
}

}  // namespace colmap_graphmatch
