#include <boost/program_options.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {
namespace {

namespace po = boost::program_options;

constexpr unsigned kLineLength = 100;
constexpr unsigned kHelpLength = 50;

po::options_description Group(const std::string& title) {
  return po::options_description(title, kLineLength, kHelpLength);
}

void AddTo(po::options_description* group, const OptionRow& row) {
  std::string help = row.help;
  if (row.use == OptionRow::Use::kPassedOn) help += " (" + row.ColmapDefaults() + ")";
  const std::string spelling = row.name == "help" ? "help,h" : row.name;
  if (row.values.empty()) {
    group->add_options()(spelling.c_str(), help.c_str());
  } else if (row.default_value.empty()) {
    group->add_options()(spelling.c_str(), po::value<std::string>(), help.c_str());
  } else {
    group->add_options()(spelling.c_str(),
                         po::value<std::string>()->default_value(row.default_value), help.c_str());
  }
}

}  // namespace

void PrintHelp(std::ostream& stream) {
  stream << "graphmatch_matcher --database_path DATABASE [options]\n\n"
            "Finds which photos of a COLMAP database show the same place, matches them and has "
            "COLMAP verify\nthem, in place of `colmap vocab_tree_matcher` and without a vocabulary "
            "tree. For example, with a\npage that shows what was found:\n\n"
            "  graphmatch_matcher --database_path database.db --image_path images \\\n"
            "      --GraphMatching.report report.html\n\n";
  CommandLine defaults;
  po::options_description common = Group("The options that are used most");
  for (const OptionRow& row : MakeOptionTable(&defaults)) {
    if (row.is_common) AddTo(&common, row);
  }
  stream << common
         << "\nAll options, COLMAP's of matching and verification among them: graphmatch_matcher "
            "--help-all\n";
}

void PrintFullHelp(std::ostream& stream) {
  stream << "graphmatch_matcher --database_path DATABASE [options]\n\n"
            "Finds which images of a COLMAP database show the same place, matches them, has COLMAP "
            "verify them, and\nwrites the two-view geometries to the database, ready for `colmap "
            "mapper`. A replacement for\n`colmap vocab_tree_matcher` that needs no vocabulary "
            "tree.\n\n";
  CommandLine defaults;
  const std::vector<OptionRow> rows = MakeOptionTable(&defaults);
  for (auto row = rows.begin(); row != rows.end();) {
    if (row->use == OptionRow::Use::kUnused) {
      ++row;
      continue;
    }
    const std::string title = row->section;
    po::options_description section = Group(title);
    for (; row != rows.end() && row->section == title; ++row) AddTo(&section, *row);
    stream << section << '\n';
  }
  stream << "All other options of `colmap vocab_tree_matcher` of COLMAP 3.8 to 4.2 are accepted, "
            "too, and have no effect.\n";
}

}  // namespace colmap_graphmatch
