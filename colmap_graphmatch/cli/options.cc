#include "colmap_graphmatch/cli/options.h"

#include <algorithm>
#include <array>
#include <boost/lexical_cast.hpp>
#include <boost/program_options.hpp>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <numeric>
#include <ostream>
#include <set>
#include <utility>

#include "colmap_graphmatch/base/errors.h"

namespace colmap_graphmatch {
namespace {

namespace po = boost::program_options;

enum class ValueType { kBool, kInt, kDouble, kText };

// An option of COLMAP's feature matching and geometric verification that is handed on to COLMAP.
// COLMAP moved them between groups from version to version; here every one may be given in any of
// the groups.
struct ColmapOption {
  const char* name;
  const char* group;  // The group shown in the help: the one of COLMAP 3.13 and later.
  ValueType type;
  const char* help;
};

constexpr std::array<const char*, 3> kGroups = {"SiftMatching", "TwoViewGeometry",
                                                "FeatureMatching"};

constexpr std::array<ColmapOption, 24> kColmapOptions = {{
    {"use_gpu", "FeatureMatching", ValueType::kBool,
     "match on the GPU if the installed COLMAP can (default 1)"},
    {"gpu_index", "FeatureMatching", ValueType::kText,
     "which GPUs, e.g. 0,1; -1: all (default -1)"},
    {"num_threads", "FeatureMatching", ValueType::kInt,
     "cores to use at a time, COLMAP's included; -1: all (default -1)"},
    {"max_ratio", "SiftMatching", ValueType::kDouble,
     "greatest ratio of the angles to the best and the second best match (COLMAP: 0.8)"},
    {"max_distance", "SiftMatching", ValueType::kDouble,
     "greatest angle to the best match, in radians (COLMAP: 0.7)"},
    {"cross_check", "SiftMatching", ValueType::kBool,
     "keep a match only if it is the best in both directions (COLMAP: 1)"},
    {"max_num_matches", "FeatureMatching", ValueType::kInt,
     "features of an image that are matched at most (COLMAP: 32768)"},
    {"guided_matching", "FeatureMatching", ValueType::kBool,
     "match again along the epipolar geometry that was found (COLMAP: 0)"},
    {"min_num_inliers", "TwoViewGeometry", ValueType::kInt,
     "inliers that make a pair an edge (default 15)"},
    {"max_error", "TwoViewGeometry", ValueType::kDouble,
     "greatest epipolar error of an inlier, in pixels (COLMAP: 4)"},
    {"confidence", "TwoViewGeometry", ValueType::kDouble, "confidence of RANSAC (COLMAP: 0.999)"},
    {"max_num_trials", "TwoViewGeometry", ValueType::kInt,
     "trials of RANSAC at most (COLMAP: 10000)"},
    {"min_inlier_ratio", "TwoViewGeometry", ValueType::kDouble,
     "inlier ratio that RANSAC counts on (COLMAP: 0.25; 0 since 3.13)"},
    {"multiple_models", "TwoViewGeometry", ValueType::kBool,
     "look for several motions in a pair (COLMAP: 0)"},
    {"compute_relative_pose", "TwoViewGeometry", ValueType::kBool,
     "store the relative pose as well (COLMAP: 0)"},
    {"planar_scene", "SiftMatching", ValueType::kBool, "the scene is planar (COLMAP 3.8: 0)"},
    {"cpu_brute_force_matcher", "SiftMatching", ValueType::kBool,
     "match exactly, without a GPU much slower (COLMAP 3.12 and later: 0)"},
    {"detect_watermark", "TwoViewGeometry", ValueType::kBool,
     "mark pairs that only a watermark links (COLMAP 3.13 and later: 1)"},
    {"multiple_ignore_watermark", "TwoViewGeometry", ValueType::kBool,
     "leave watermarks out of several motions (COLMAP 3.13 and later: 1)"},
    {"watermark_detection_max_error", "TwoViewGeometry", ValueType::kDouble,
     "greatest error of a watermark's inlier, in pixels (COLMAP 3.13 and later: 4)"},
    {"filter_stationary_matches", "TwoViewGeometry", ValueType::kBool,
     "drop matches at the same place in both images (COLMAP 3.13 and later: 0)"},
    {"stationary_matches_max_error", "TwoViewGeometry", ValueType::kDouble,
     "what the same place means, in pixels (COLMAP 3.13 and later: 4)"},
    {"use_degensac", "TwoViewGeometry", ValueType::kBool, "use DEGENSAC (COLMAP 4: 0)"},
    {"use_sampson_refinement", "TwoViewGeometry", ValueType::kBool,
     "refine by Sampson errors (COLMAP 4.2: 1)"},
}};

// Options of vocab_tree_matcher that only make sense with a vocabulary tree, or with COLMAP's log.
constexpr std::array<const char*, 13> kUnusedOptions = {
    "log_to_stderr",
    "log_target",
    "log_path",
    "log_level",
    "log_severity",
    "log_color",
    "VocabTreeMatching.vocab_tree_path",
    "VocabTreeMatching.num_images",
    "VocabTreeMatching.num_nearest_neighbors",
    "VocabTreeMatching.num_checks",
    "VocabTreeMatching.num_images_after_verification",
    "VocabTreeMatching.max_num_features",
    "VocabTreeMatching.num_threads"};

constexpr unsigned kLineLength = 100;
constexpr unsigned kHelpLength = 50;

// What the user may write for an enumeration.
template <typename Enum>
using Names = std::map<std::string, Enum>;

const Names<GraphMatchOptions::SamplingSchedule> kSchedules = {
    {"floor", GraphMatchOptions::SamplingSchedule::kFloor},
    {"round", GraphMatchOptions::SamplingSchedule::kRound},
    {"carry", GraphMatchOptions::SamplingSchedule::kCarry}};
const Names<GraphMatchOptions::PropagationDistance> kDistances = {
    {"source", GraphMatchOptions::PropagationDistance::kSource},
    {"neighbor", GraphMatchOptions::PropagationDistance::kNeighbor}};
const Names<PipelineOptions::Strategy> kStrategies = {
    {"graphmatch", PipelineOptions::Strategy::kGraphMatch},
    {"exhaustive", PipelineOptions::Strategy::kExhaustive}};
const Names<ColmapVerifierOptions::Matcher> kMatchers = {
    {"auto", ColmapVerifierOptions::Matcher::kAuto},
    {"exact", ColmapVerifierOptions::Matcher::kExact},
    {"colmap", ColmapVerifierOptions::Matcher::kColmap}};
const Names<ImageVectorOptions::FeatureSelection> kSelections = {
    {"largest", ImageVectorOptions::FeatureSelection::kLargestScales},
    {"random", ImageVectorOptions::FeatureSelection::kRandom}};

// An option whose value is one of some names, bound to an enumeration.
template <typename Enum>
po::typed_value<std::string>* OneOf(const std::string& option, const Names<Enum>& names,
                                    Enum* field) {
  std::string initial;
  std::string allowed;
  for (const auto& [name, value] : names) {
    if (value == *field) initial = name;
    allowed += (allowed.empty() ? "" : ", ") + name;
  }
  return po::value<std::string>()->default_value(initial)->notifier(
      [option, &names, allowed, field](const std::string& text) {
        const auto found = names.find(text);
        if (found == names.end()) {
          throw OptionsError("--" + option + " is \"" + text + "\"; it must be one of " + allowed +
                             ".");
        }
        *field = found->second;
      });
}

template <typename T>
po::typed_value<T>* Field(T* field) {
  return po::value<T>(field)->default_value(*field);
}

class Options {
 public:
  Options() {
    PipelineOptions& p = line_.pipeline;
    po::options_description general("General", kLineLength, kHelpLength);
    general.add_options()("help,h", "print this help")("version", "print the version")(
        "database_path", po::value<std::string>(),
        "the COLMAP database with the features; the matches are written to it")(
        "project_path", po::value<std::string>(),
        "an ini file with options, as COLMAP writes it; the command line goes before")(
        "colmap_path", Field(&p.colmap_path), "the COLMAP program: a path, or a name on PATH")(
        "random_seed", Field(&p.seed),
        "of this program's random choices; COLMAP's CPU matching has its own");

    po::options_description graph("GraphMatch: which pairs are tested", kLineLength, kHelpLength);
    graph.add_options()("GraphMatching.strategy",
                        OneOf("GraphMatching.strategy", kStrategies, &p.strategy),
                        "which pairs are tested: those that graphmatch finds, or exhaustive: all")(
        "GraphMatching.match_list_path", po::value<std::string>(),
        "a file of image pairs to be tested instead, two names a line")(
        "GraphMatching.number_sample_iterations", Field(&p.graph.number_sample_iterations),
        "iterations (>= 0) that sample before propagating; later ones only propagate")(
        "GraphMatching.max_tests_for_sampling", Field(&p.graph.max_tests_for_sampling),
        "tests (>= 0) that sampling may spend on an image; 0: max(min(0.017 N, 120), 10) of N "
        "images. "
        "More finds weaker links and costs up to N tests for each")(
        "GraphMatching.max_num_neighbors", Field(&p.graph.max_num_neighbors),
        "neighbours (>= 1) after which an image looks for no more itself. Fewer thins dense "
        "scenes")("GraphMatching.num_to_propagate", Field(&p.graph.num_to_propagate),
                  "images (>= 0) that each neighbour hands on to an image in an iteration")(
        "GraphMatching.sampling_schedule",
        OneOf("GraphMatching.sampling_schedule", kSchedules, &p.graph.sampling_schedule),
        "tests an iteration: budget / iterations as floor, round, or carry (spends it all)")(
        "GraphMatching.count_incoming_tests", Field(&p.graph.count_incoming_tests),
        "tests drawn by other images count against an image's budget, too")(
        "GraphMatching.propagation_distance",
        OneOf("GraphMatching.propagation_distance", kDistances, &p.graph.propagation_distance),
        "rank a neighbour's neighbours by their distance to the image itself (source) or to the "
        "neighbor")("GraphMatching.propagate_untested_only",
                    Field(&p.graph.propagate_untested_only),
                    "take the best among the untested; 0: among all, then drop the tested")(
        "GraphMatching.propagate_from_new_edges_only",
        Field(&p.graph.propagate_from_new_edges_only), "propagate along each edge only once")(
        "GraphMatching.stop_sampling_without_edges", Field(&p.graph.stop_sampling_without_edges),
        "end sampling after an iteration that found no edge");

    po::options_description vectors("GraphMatch: how images are described", kLineLength,
                                    kHelpLength);
    vectors.add_options()("GraphMatching.num_components", Field(&p.vectors.gmm.num_components),
                          "Gaussians (>= 1) of the mixture; time and memory grow in proportion")(
        "GraphMatching.max_num_features", Field(&p.vectors.max_num_features),
        "features (>= 1) of an image that are encoded at most")(
        "GraphMatching.feature_selection",
        OneOf("GraphMatching.feature_selection", kSelections, &p.vectors.feature_selection),
        "which, if it has more: those of the largest scales, or random ones")(
        "GraphMatching.num_training_descriptors", Field(&p.vectors.num_training_descriptors),
        "descriptors (>= 1) that the mixture is learnt from");

    ExactMatcherOptions& exact = p.verification.exact;
    po::options_description matching("GraphMatch: how descriptors are matched", kLineLength,
                                     kHelpLength);
    matching.add_options()(
        "GraphMatching.matcher", OneOf("GraphMatching.matcher", kMatchers, &p.verification.matcher),
        "exact: by this program; colmap: by COLMAP; auto: by COLMAP if it has a GPU and use_gpu is "
        "on, else exact")(
        "GraphMatching.cache_gb", Field(&exact.cache_gb),
        "GB (>= 0) of descriptors kept in memory; 0: a quarter of the memory. Less reads images "
        "more often")(
        "GraphMatching.preemptive_num_features", Field(&exact.preemptive_num_features),
        "features (>= 1) of the largest scales that are matched first, to give up pairs "
        "with few matches early; 0: match all at once")(
        "GraphMatching.preemptive_min_matches", Field(&exact.preemptive_min_matches),
        "matches (>= 1) of those that a pair needs, or else it counts as tested, without an edge");

    po::options_description work("GraphMatch: how COLMAP is run", kLineLength, kHelpLength);
    work.add_options()("GraphMatching.num_processes", Field(&p.verification.num_processes),
                       "COLMAP processes at a time; 0: one a core without a GPU, else one")(
        "GraphMatching.max_pairs_per_shard", Field(&p.verification.max_pairs_per_shard),
        "pairs (>= 1) that COLMAP gets at a time; kill -9 loses at most so many verified pairs a "
        "process")("GraphMatching.timeout_per_pair", Field(&p.verification.timeout_per_pair),
                   "seconds (> 0) a pair after which COLMAP counts as hanging")(
        "GraphMatching.lock_timeout", Field(&p.verification.lock_timeout),
        "seconds (>= 0) to wait while another program locks the database")(
        "GraphMatching.work_path", po::value<std::string>(),
        "where temporary files go (default: $TMPDIR or /tmp); some 100 MB a process");

    po::options_description colmap(
        "COLMAP's own options, accepted in each of the groups SiftMatching, TwoViewGeometry and "
        "FeatureMatching",
        kLineLength, kHelpLength);
    for (const ColmapOption& option : kColmapOptions) {
      for (const char* group : kGroups) {
        const std::string name = std::string(group) + "." + option.name;
        (group == std::string(option.group) ? colmap : hidden_)
            .add_options()(name.c_str(), po::value<std::string>(), option.help);
      }
    }
    hidden_.add_options()("default_random_seed", po::value<std::uint64_t>(), "");
    for (const char* name : kUnusedOptions) {
      hidden_.add_options()(name, po::value<std::string>(), "");
    }
    visible_.add(general).add(graph).add(vectors).add(matching).add(work).add(colmap);
  }

  CommandLine Parse(int argc, const char* const* argv) {
    po::options_description all;
    all.add(visible_).add(hidden_);
    po::variables_map values;
    std::set<std::string> given;
    try {
      const po::parsed_options parsed = po::parse_command_line(argc, argv, all);
      po::store(parsed, values);
      line_.help = values.count("help") > 0;
      line_.version = values.count("version") > 0;
      if (line_.help || line_.version) return line_;
      for (const po::option& option : parsed.options) {
        given.insert(option.string_key);
        // Boost takes what does not begin with a dash for something to be ignored.
        if (option.position_key >= 0) {
          throw OptionsError("\"" + option.original_tokens.front() +
                             "\" on the command line belongs to no option; options begin with --. "
                             "`graphmatch_matcher -h` lists them.");
        }
      }
      if (values.count("project_path") > 0) {
        StoreProject(values["project_path"].as<std::string>(), all, given, &values);
      }
      po::notify(values);
    } catch (const po::unknown_option& error) {
      throw OptionsError(std::string(error.what()) + ". Did you mean --" +
                         NearestOption(error.get_option_name(), all) +
                         "? `graphmatch_matcher -h` lists the options.");
    } catch (const po::error& error) {
      throw OptionsError(std::string(error.what()) +
                         ". `graphmatch_matcher -h` lists the options.");
    }
    if (values.count("database_path") == 0) {
      throw OptionsError(
          "--database_path is missing: the COLMAP database with the features. `graphmatch_matcher "
          "-h` lists the options.");
    }
    // The name that random_seed has since COLMAP 3.13.
    if (values.count("default_random_seed") > 0) {
      line_.pipeline.seed = values["default_random_seed"].as<std::uint64_t>();
    }
    line_.pipeline.database_path = values["database_path"].as<std::string>();
    if (values.count("GraphMatching.work_path") > 0) {
      line_.pipeline.work_path = values["GraphMatching.work_path"].as<std::string>();
    }
    if (values.count("GraphMatching.match_list_path") > 0) {
      line_.pipeline.match_list_path = values["GraphMatching.match_list_path"].as<std::string>();
      if (line_.pipeline.match_list_path.empty()) {
        throw OptionsError("--GraphMatching.match_list_path is empty; it must name a file.");
      }
    }
    for (const ColmapOption& option : kColmapOptions) ReadColmapOption(option, values);
    for (const char* name : kUnusedOptions) {
      // Not those of a project file: COLMAP writes every option into it.
      if (given.count(name) > 0) line_.unused_options.emplace_back(name);
    }
    line_.pipeline.verification.num_threads = line_.pipeline.num_threads;
    line_.pipeline.Check();
    return line_;
  }

  const po::options_description& Visible() const { return visible_; }

 private:
  // Reads an ini file of COLMAP. What was given on the command line, in any spelling, goes before;
  // options of other commands are left out.
  static void StoreProject(const std::string& path, const po::options_description& all,
                           const std::set<std::string>& given, po::variables_map* values) {
    std::ifstream file(path);
    if (!file) {
      throw OptionsError("Cannot read the project file " + path + " (--project_path).");
    }
    std::set<std::string> given_in_any_group;
    for (const std::string& name : given) given_in_any_group.insert(WithoutGroup(name));
    po::parsed_options project = po::parse_config_file(file, all, true);
    const auto is_left_out = [&](const po::option& option) {
      return option.unregistered || given.count(option.string_key) > 0 ||
             (IsOfColmap(option.string_key) &&
              given_in_any_group.count(WithoutGroup(option.string_key)) > 0);
    };
    project.options.erase(
        std::remove_if(project.options.begin(), project.options.end(), is_left_out),
        project.options.end());
    po::store(project, *values);
  }

  static std::string WithoutGroup(const std::string& name) {
    return name.substr(name.find('.') + 1);
  }

  // Whether it is one of kColmapOptions, in any group.
  static bool IsOfColmap(const std::string& name) {
    return std::any_of(kGroups.begin(), kGroups.end(),
                       [&](const std::string& group) { return name.rfind(group + ".", 0) == 0; });
  }

  // The first option whose name takes the fewest insertions, deletions and replacements of a letter
  // (Levenshtein). The group does not count: COLMAP's options moved between them.
  static std::string NearestOption(const std::string& unknown, const po::options_description& all) {
    const std::string name =
        WithoutGroup(unknown.substr(std::min(unknown.find_first_not_of('-'), unknown.size())));
    std::string nearest;
    std::size_t least = std::numeric_limits<std::size_t>::max();
    for (const auto& option : all.options()) {
      const std::size_t distance = EditDistance(name, WithoutGroup(option->long_name()));
      if (distance >= least) continue;
      least = distance;
      nearest = option->long_name();
    }
    return nearest;
  }

  static std::size_t EditDistance(const std::string& a, const std::string& b) {
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

  void ReadColmapOption(const ColmapOption& option, const po::variables_map& values) {
    std::string given;
    std::string text;
    for (const char* group : kGroups) {
      const std::string name = std::string(group) + "." + option.name;
      if (values.count(name) == 0) continue;
      const auto value = values[name].as<std::string>();
      if (!given.empty() && value != text) {
        throw OptionsError("--" + given + " " + text + " and --" + name + " " + value +
                           " are the same option with different values. Give one of them.");
      }
      given = name;
      text = value;
    }
    if (given.empty()) return;

    PipelineOptions& p = line_.pipeline;
    DescriptorMatchingOptions& matching = p.verification.exact.matching;
    try {
      const std::string name = option.name;
      if (option.type == ValueType::kBool) {
        const bool value = ParseBool(text);
        if (name == "use_gpu") {
          p.verification.use_gpu = value;
          return;
        }
        if (name == "cross_check") {
          matching.cross_check = value;
          return;
        }
        text = value ? "1" : "0";
      } else if (option.type == ValueType::kInt) {
        const int value = boost::lexical_cast<int>(text);
        if (name == "num_threads") {
          p.num_threads = value;
          return;
        }
        if (name == "max_num_matches") {
          matching.max_num_matches = value;
          return;
        }
        if (name == "min_num_inliers") {
          p.verification.min_num_inliers = value;
          return;
        }
      } else if (option.type == ValueType::kDouble) {
        const auto value = boost::lexical_cast<double>(text);
        if (name == "max_ratio") {
          matching.max_ratio = value;
          return;
        }
        if (name == "max_distance") {
          matching.max_distance = value;
          return;
        }
      }
      p.verification.colmap_options[name] = text;
    } catch (const boost::bad_lexical_cast&) {
      static const std::map<ValueType, std::string> kTypes = {{ValueType::kBool, "0 or 1"},
                                                              {ValueType::kInt, "an integer"},
                                                              {ValueType::kDouble, "a number"}};
      throw OptionsError("--" + given + " is \"" + text + "\"; it must be " +
                         kTypes.at(option.type) + ".");
    }
  }

  static bool ParseBool(const std::string& text) {
    if (text == "true" || text == "yes" || text == "on") return true;
    if (text == "false" || text == "no" || text == "off") return false;
    return boost::lexical_cast<bool>(text);
  }

  CommandLine line_;
  po::options_description visible_{kLineLength, kHelpLength};
  po::options_description hidden_;
};

}  // namespace

CommandLine ParseCommandLine(int argc, const char* const* argv) {
  return Options().Parse(argc, argv);
}

void PrintHelp(std::ostream& stream) {
  stream << "graphmatch_matcher --database_path DATABASE [options]\n\n"
            "Finds which images of a COLMAP database show the same place, matches them, has COLMAP "
            "verify them, and\nwrites the two-view geometries to the database, ready for `colmap "
            "mapper`. A "
            "replacement for\n`colmap vocab_tree_matcher` that needs no vocabulary tree.\n\n"
            "Options"
         << Options().Visible() << '\n';
}

}  // namespace colmap_graphmatch
