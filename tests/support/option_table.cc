// option_table VERSION: compares the table of options with what `colmap vocab_tree_matcher -h` of
// that version of COLMAP printed, on the standard input; exit code 1 if they differ.

#include "colmap_graphmatch/cli/option_table.h"

#include <iostream>
#include <iterator>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {
namespace {

// COLMAP prints 0.8 as 0.80000000000000004 before 4.0.
bool SameDefault(const std::string& a, const std::string& b) {
  if (a == b) return true;
  std::istringstream stream_a(a);
  std::istringstream stream_b(b);
  double number_a = 0;
  double number_b = 0;
  return stream_a >> number_a && stream_b >> number_b && number_a == number_b;
}

int Check(const ColmapVersion& version, const std::string& help) {
  std::map<std::string, std::string> printed;  // Defaults by name.
  static const std::regex kOption(
      R"(\n +(?:-h \[ )?--([A-Za-z0-9_.]+)(?: \])?(?: arg)?(?: \(=([^)]*)\))?)");
  for (std::sregex_iterator match(help.begin(), help.end(), kOption), end; match != end; ++match) {
    printed[(*match)[1]] = (*match)[2];
  }
  CommandLine line;
  std::size_t num_same = 0;
  int code = 0;
  const auto complain = [&code](const std::string& problem) {
    std::cerr << problem << std::endl;
    code = 1;
  };
  for (const OptionRow& row : MakeOptionTable(&line)) {
    const ColmapSpelling* spelling = row.In(version);
    if (row.name == "help") printed.erase("help");
    if (spelling == nullptr) continue;
    const auto found = printed.find(spelling->name);
    if (found == printed.end()) {
      complain("COLMAP does not have " + spelling->name);
      continue;
    }
    if (!SameDefault(found->second, spelling->default_value)) {
      complain("The default of " + spelling->name + " is " + found->second + ", not " +
               spelling->default_value);
    }
    printed.erase(found);
    ++num_same;
  }
  for (const auto& [name, default_value] : printed) complain("The table does not have " + name);
  std::cout << num_same << " options of COLMAP " << version.major << "." << version.minor
            << " are as the table says." << std::endl;
  return num_same == 0 ? 1 : code;
}

int Main(const std::vector<std::string>& arguments) {
  ColmapVersion version;
  char dot = 0;
  if (arguments.size() == 1 &&
      std::istringstream(arguments[0]) >> version.major >> dot >> version.minor) {
    const std::string help((std::istreambuf_iterator<char>(std::cin)),
                           std::istreambuf_iterator<char>());
    return Check(version, help);
  }
  std::cerr << "usage: option_table VERSION" << std::endl;
  return 1;
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) {
  return colmap_graphmatch::Main(std::vector<std::string>(argv + 1, argv + argc));
}
