#include <boost/program_options.hpp>
#include <ostream>

#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {
namespace {

namespace po = boost::program_options;

constexpr unsigned kLineLength = 100;
constexpr unsigned kHelpLength = 50;

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
      if (row->use == OptionRow::Use::kPassedOn) help += " (" + row->ColmapDefaults() + ")";
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

}  // namespace colmap_graphmatch
