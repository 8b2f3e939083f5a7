#include "colmap_graphmatch/cli/options.h"

#include <algorithm>
#include <boost/lexical_cast.hpp>
#include <boost/program_options.hpp>
#include <cctype>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <tuple>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/option_values.h"
#include "colmap_graphmatch/cli/run_files.h"
#include "colmap_graphmatch/verification/colmap_installation.h"

namespace colmap_graphmatch {
namespace {

namespace po = boost::program_options;

constexpr char kSeeHelp[] = "`graphmatch_matcher --help-all` lists the options.";

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

// Whether two texts are the same value: 4 and 4.0, 1 and true.
bool SameValue(const std::string& a, const std::string& b) {
  if (a == b) return true;
  const std::optional<bool> bool_a = ParseBool(a);
  const std::optional<bool> bool_b = ParseBool(b);
  if (bool_a && bool_b) return *bool_a == *bool_b;
  double number_a = 0;
  double number_b = 0;
  return boost::conversion::try_lexical_convert(a, number_a) &&
         boost::conversion::try_lexical_convert(b, number_b) && number_a == number_b;
}

// Boost puts names and values where its messages have %value% and the like, again and again: where
// they contain that themselves, what() would never return. This takes such marks apart.
class Substitutions : public po::error_with_option_name {
 public:
  static void TakeMarksApart(po::error_with_option_name* error) {
    for (auto& [name, text] : error->*(&Substitutions::m_substitutions)) {
      for (std::size_t i = text.find('%'); i != std::string::npos; i = text.find('%', i + 1)) {
        if (i + 1 < text.size() && std::isalpha(static_cast<unsigned char>(text[i + 1])) != 0) {
          text.insert(i + 1, " ");
        }
      }
    }
  }
};

std::string MessageOf(po::error* error) {
  auto* with_name = dynamic_cast<po::error_with_option_name*>(error);
  if (with_name != nullptr) Substitutions::TakeMarksApart(with_name);
  return error->what();
}

class Parser {
 public:
  Parser(CommandLine* line, const StopRequest* stop)
      : line_(line), stop_(stop), rows_(MakeOptionTable(line)) {
    for (const OptionRow& row : rows_) {
      for (const std::string& name : row.names) {
        if (name.size() == 1) continue;  // Comes with its long name.
        by_name_[name] = &row;
        const std::string with_letter = name == "help" ? "help,h" : name;
        if (row.values.empty()) {
          accepted_.add_options()(with_letter.c_str(), "");
        } else {
          accepted_.add_options()(with_letter.c_str(), po::value<std::string>(), "");
        }
      }
    }
  }

  void Parse(int argc, const char* const* argv) {
    ReadArguments(argc, argv);
    if (line_->help || line_->help_all || line_->version) return;
    if (!line_->project_path.empty()) ReadProject();
    if (line_->pipeline.database_path.empty()) {
      throw OptionsError(
          "--database_path is missing: the COLMAP database with the features. `graphmatch_matcher "
          "-h` has an example.");
    }
    PipelineOptions& p = line_->pipeline;
    if (line_->lightglue) {
      if (p.verification.matcher == VerificationOptions::Matcher::kExact) {
        throw OptionsError(
            "--FeatureMatching.type SIFT_LIGHTGLUE and --GraphMatching.matcher exact contradict "
            "each other: COLMAP alone has LightGlue. Give one of them.");
      }
      p.verification.matcher = VerificationOptions::Matcher::kColmap;
      p.verification.colmap_options["FeatureMatching.type"] = "SIFT_LIGHTGLUE";
    }
    if (line_->seed_from_clock) {
      p.seed = std::random_device()();
      p.verification.colmap_options["default_random_seed"] = "-1";
    } else if (p.seed != 0) {
      // COLMAP's seed is an int.
      p.verification.colmap_options["default_random_seed"] =
          std::to_string(p.seed % (std::uint64_t{1} << 31U));
    }
    LogOptions& log = line_->log;
    if (!line_->log_to_stderr && !log.path.empty()) log.target = LogOptions::Target::kFile;
    if (log.target == LogOptions::Target::kFile && log.path.empty()) {
      throw OptionsError("--log_target file needs --log_path, the file that is meant.");
    }
    CheckFiles();
    p.Check();
    SayWhatHasNoEffect();
    if (line_->dry_run && (!p.RanksImages() || !p.replay_path.empty())) {
      throw OptionsError(
          "--GraphMatching.dry_run shows which pairs a strategy that ranks images would test "
          "first; with a list of pairs, the strategy exhaustive or --GraphMatching.replay_path "
          "there is nothing to show.");
    }
  }

 private:
  void CheckFiles() {
    PipelineOptions& p = line_->pipeline;
    const auto& graph = line_->graph_path;
    if (line_->dry_run &&
        (!line_->report_path.empty() || !graph.empty() || !p.pair_log_path.empty())) {
      throw OptionsError(
          "With --GraphMatching.dry_run nothing is tested: there is nothing for "
          "--GraphMatching.report, --GraphMatching.export_graph or --GraphMatching.pair_log to "
          "tell. --GraphMatching.export_pairs writes the candidates.");
    }
    const auto& photos = p.ranking.vectors.image_path;
    std::error_code ignored;
    if (!photos.empty() && !std::filesystem::is_directory(photos, ignored)) {
      throw OptionsError("--image_path is " + photos.string() +
                         ", and there is no such directory.");
    }
    const std::string ending = graph.extension().string();
    if (!graph.empty() && ending != ".graphml" && ending != ".dot" && ending != ".gv") {
      throw OptionsError("--GraphMatching.export_graph is " + graph.string() +
                         "; it must end in .graphml, or in .dot or .gv for Graphviz.");
    }
    CheckThatFilesDiffer(FilesOfRun(*line_));
    p.keep_details =
        !line_->report_path.empty() || !line_->pair_list_path.empty() || !graph.empty();
  }

  struct Given {
    std::string name;
    std::string value;
  };

  void ReadArguments(int argc, const char* const* argv) {
    po::parsed_options parsed(&accepted_);
    try {
      parsed = po::parse_command_line(argc, argv, accepted_);
    } catch (po::unknown_option& error) {
      throw OptionsError(MessageOf(&error) + ". " + Suggest(error.get_option_name()));
    } catch (po::error& error) {
      throw OptionsError(MessageOf(&error) + ". " + kSeeHelp);
    }
    std::vector<Given> given;
    for (const po::option& option : parsed.options) {
      // Boost takes what does not begin with a dash for something to be ignored.
      if (option.position_key >= 0) {
        throw OptionsError("\"" + option.original_tokens.front() +
                           "\" on the command line belongs to no option; options begin with --. " +
                           kSeeHelp);
      }
      given.push_back({option.string_key, option.value.empty() ? "" : option.value.front()});
    }
    for (const Given& option : given) {
      const OptionRow& row = *by_name_.at(option.name);
      const bool is_first = on_command_line_.insert(&row).second;
      asked_for_.emplace(&row, option.name);
      if (row.use == OptionRow::Use::kUnused && is_first) SayUnused(option.name, row);
    }
    Store(given, "");
  }

  // Reads an ini file of COLMAP. What was given on the command line, in any spelling, goes before;
  // options of other commands are left out.
  void ReadProject() {
    const std::string path = line_->project_path.string();
    std::istringstream file;
    try {
      file.str(ReadText(path, stop_));
    } catch (const UnreadableFileError& error) {
      throw OptionsError("Cannot read the project file " + path +
                         " (--project_path): " + error.Reason() + ".");
    }
    po::parsed_options parsed(&accepted_);
    try {
      parsed = po::parse_config_file(file, accepted_, true);
    } catch (po::error& error) {
      throw OptionsError("The project file " + path +
                         " (--project_path) is no ini file: " + MessageOf(&error) + ".");
    }
    std::vector<Given> given;
    for (const po::option& option : parsed.options) {
      const auto row = by_name_.find(option.string_key);
      if (row == by_name_.end()) {
        const std::string group = option.string_key.substr(0, option.string_key.find('.'));
        const std::string problem = "The project file " + path + " has the unknown option " +
                                    option.string_key + ". " + Suggest(option.string_key);
        if (group == "GraphMatching") throw OptionsError(problem);
        // It may be one of a newer COLMAP.
        static const std::set<std::string> kColmapsGroups = {
            "SiftMatching", "TwoViewGeometry", "FeatureMatching", "VocabTreeMatching"};
        if (kColmapsGroups.count(group) > 0) line_->warnings.push_back(problem);
        continue;
      }
      const std::string value = option.value.empty() ? "" : option.value.front();
      // COLMAP writes options without a value, too.
      if (value.empty() || on_command_line_.count(row->second) > 0) continue;
      if (row->second->use == OptionRow::Use::kUnused && !IsDefault(*row->second, value)) {
        SayUnused(option.string_key, *row->second);
      }
      given.push_back({option.string_key, value});
      if (!IsDefault(*row->second, value)) asked_for_.emplace(row->second, option.string_key);
    }
    Store(given, " in " + path);
  }

  void Store(const std::vector<Given>& given, const std::string& where) const {
    std::map<const OptionRow*, const Given*> first;
    for (const Given& option : given) {
      const OptionRow* row = by_name_.at(option.name);
      const auto [earlier, is_first] = first.emplace(row, &option);
      if (!is_first && !SameValue(earlier->second->value, option.value)) {
        throw OptionsError("--" + earlier->second->name + " " + earlier->second->value + " and --" +
                           option.name + " " + option.value + where +
                           " are the same option with different values. Give one of them.");
      }
      if (!row->read(option.value)) {
        throw OptionsError("--" + option.name + where + " is \"" + option.value +
                           "\"; it must be " + row->values + ".");
      }
    }
  }

  // COLMAP writes every option into its project files: a default was not asked for.
  static bool IsDefault(const OptionRow& row, const std::string& value) {
    return std::any_of(row.colmap.begin(), row.colmap.end(), [&](const ColmapSpelling& spelling) {
      return SameValue(spelling.default_value, value);
    });
  }

  void SayWhatHasNoEffect() {
    for (const OptionRow& row : rows_) {
      if (row.has_effect == nullptr || row.has_effect()) continue;
      const auto given = asked_for_.find(&row);
      if (given == asked_for_.end()) continue;
      const PipelineOptions& p = line_->pipeline;
      const bool is_of_descriptor = row.belongs_to.find(".descriptor ") != std::string::npos;
      std::string reason = "it is for " + row.belongs_to;
      if (!p.RanksImages())
        reason = "no image is ranked";
      else if (is_of_descriptor && !p.ranking.ranking_path.empty())
        reason = "images are ranked by a file";
      line_->unused_options.push_back("--" + given->second + " has no effect here: " + reason +
                                      ".");
    }
  }

  void SayUnused(const std::string& name, const OptionRow& row) {
    line_->unused_options.push_back("--" + name + " has no effect here: " + row.help + ".");
  }

  // The option whose name takes the fewest insertions, deletions and replacements of a letter
  // (Levenshtein); of names that differ in the group alone the one that the help shows: COLMAP's
  // options moved between groups.
  std::string Suggest(const std::string& unknown) const {
    const std::string given =
        Lower(unknown.substr(std::min(unknown.find_first_not_of('-'), unknown.size())));
    std::tuple<std::size_t, bool, std::size_t> least(std::numeric_limits<std::size_t>::max(), true,
                                                     0);
    std::string nearest;
    for (const auto& [name, row] : by_name_) {
      const std::tuple<std::size_t, bool, std::size_t> distance(
          EditDistance(WithoutGroup(given), WithoutGroup(Lower(name))), name != row->name,
          EditDistance(given, Lower(name)));
      if (distance >= least) continue;
      least = distance;
      nearest = name;
    }
    // Most of it has to be right.
    if (std::get<0>(least) * 2 > WithoutGroup(given).size()) return kSeeHelp;
    return "Did you mean --" + nearest + "? " + kSeeHelp;
  }

  CommandLine* line_;
  const StopRequest* stop_;
  std::vector<OptionRow> rows_;
  std::map<std::string, const OptionRow*> by_name_;
  po::options_description accepted_;
  std::set<const OptionRow*> on_command_line_;
  std::map<const OptionRow*, std::string> asked_for_;  // Anywhere, under this name.
};

}  // namespace

CommandLine ParseCommandLine(int argc, const char* const* argv, const StopRequest* stop) {
  CommandLine line;
  Parser(&line, stop).Parse(argc, argv);
  return line;
}

}  // namespace colmap_graphmatch
