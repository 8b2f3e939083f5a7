#pragma once

#include <functional>
#include <string>
#include <tuple>
#include <vector>

namespace colmap_graphmatch {

struct CommandLine;

// A version of COLMAP, as far as its options are concerned.
struct ColmapVersion {
  int major = 0;
  int minor = 0;

  friend bool operator<(const ColmapVersion& a, const ColmapVersion& b) {
    return std::tie(a.major, a.minor) < std::tie(b.major, b.minor);
  }
};

// How an option of `colmap vocab_tree_matcher` is spelt from a version of COLMAP on, and its
// default there.
struct ColmapSpelling {
  ColmapVersion first;
  std::string name;  // Empty: no longer there.
  std::string default_value;
};

// Everything there is to know about an option. The command line, project files, what COLMAP is
// handed, the help, docs/options.md, the man page and the shells' completions all come from the
// rows of one table.
struct OptionRow {
  enum class Use {
    kOwn,       // An option of this program alone,
    kHere,      // one of vocab_tree_matcher that this program acts on,
    kPassedOn,  // one that goes to the installed COLMAP, in its spelling,
    kUnused,    // one that is accepted and has no meaning without a vocabulary tree.
  };
  enum class Path { kNone, kFile, kDirectory, kProgram };

  std::string section;
  std::string name;  // The spelling that the help shows: for options of COLMAP its newest one.
  Use use = Use::kOwn;
  std::string values;  // What follows "it must be" in the error; empty: a flag without a value.
  std::string default_value;
  std::vector<std::string> choices;  // All that the value may be, if they can be listed.
  Path path = Path::kNone;           // What the value is the path of.
  std::string help;
  bool is_common = false;              // One of the few that the short help shows.
  std::vector<ColmapSpelling> colmap;  // Ascending; empty for options of this program.

  // All names under which it is accepted, `name` first: those that any version of COLMAP has, and
  // for options of matching and verification each of the groups SiftMatching, TwoViewGeometry and
  // FeatureMatching, between which COLMAP moved them.
  std::vector<std::string> names;

  // What alone it is for, as it is given ("--GraphMatching.strategy briad"), and whether this run
  // is that; empty and null if it is for all.
  std::string belongs_to;
  std::function<bool()> has_effect;

  // Stores the value. False if it is not one of `values`.
  std::function<bool(const std::string& text)> read;

  // The spelling and default in a version of COLMAP, or null if it has no such option.
  const ColmapSpelling* In(const ColmapVersion& version) const;

  // COLMAP's defaults and since when, for an option that COLMAP has: "COLMAP: 0.25; since 4.2: 0",
  // "COLMAP since 3.13: 1", "COLMAP before 3.9: 0".
  std::string ColmapDefaults() const;

  // Whether the help lists the option, and under this one of its names.
  bool Shows(const std::string& a_name) const { return use != Use::kUnused && a_name == name; }
};

// "--help", "-h".
std::string WithDashes(const std::string& name);

// "3.8".
std::string ToString(const ColmapVersion& version);

// The table. Its rows store what they read in `line`, which must outlive them; defaults are those
// of `line` as it is now.
std::vector<OptionRow> MakeOptionTable(CommandLine* line);

}  // namespace colmap_graphmatch
