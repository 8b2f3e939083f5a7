#include "colmap_graphmatch/cli/option_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include "colmap_graphmatch/cli/option_values.h"
#include "colmap_graphmatch/cli/options.h"
#include "colmap_graphmatch/verification/colmap_installation.h"

namespace colmap_graphmatch {
namespace {

using Descriptor = ImageVectorOptions::Descriptor;
using Strategy = PipelineOptions::Strategy;
using Use = OptionRow::Use;

constexpr std::array<const char*, 3> kMatchingGroups = {"SiftMatching.", "TwoViewGeometry.",
                                                        "FeatureMatching."};

bool EndsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

class Table {
 public:
  explicit Table(CommandLine* line) : line_(line) {}

  std::vector<OptionRow> Make() {
    AddGeneral();
    AddGraph();
    AddOtherStrategies();
    AddVectors();
    AddMatching();
    AddWork();
    AddEvaluation();
    AddLog();
    AddColmapMatching();
    AddUnusedOptions();
    return std::move(rows_);
  }

 private:
  void Section(const char* section) { section_ = section; }

  OptionRow& Add(const std::string& name, Value value, const std::string& help) {
    OptionRow row;
    row.section = section_;
    row.name = name;
    row.values = std::move(value.values);
    row.default_value = std::move(value.default_value);
    row.read = std::move(value.read);
    row.choices = std::move(value.choices);
    row.path = value.path;
    row.help = help;
    row.names = {name};
    rows_.push_back(std::move(row));
    return rows_.back();
  }

  // Without effect in runs for which has_effect is false.
  OptionRow& AddFor(const std::string& belongs_to, std::function<bool()> has_effect,
                    const std::string& name, Value value, const std::string& help) {
    OptionRow& row = Add(name, std::move(value), help);
    row.belongs_to = belongs_to;
    row.has_effect = std::move(has_effect);
    return row;
  }

  OptionRow& AddColmap(Use use, std::vector<ColmapSpelling> colmap, Value value,
                       const std::string& help) {
    const auto newest = std::find_if(colmap.rbegin(), colmap.rend(),
                                     [](const ColmapSpelling& s) { return !s.name.empty(); });
    OptionRow& row = Add(newest->name, std::move(value), help);
    row.use = use;
    row.colmap = std::move(colmap);
    for (const ColmapSpelling& spelling : row.colmap) AddName(spelling.name, &row);
    return row;
  }

  static void AddName(const std::string& name, OptionRow* row) {
    const bool is_new = std::find(row->names.begin(), row->names.end(), name) == row->names.end();
    if (is_new && !name.empty()) row->names.push_back(name);
  }

  // An option of matching or verification: accepted in each of the groups.
  OptionRow& AddGrouped(Use use, std::vector<ColmapSpelling> colmap, Value value,
                        const std::string& help) {
    OptionRow& row = AddColmap(use, std::move(colmap), std::move(value), help);
    const std::string short_name = WithoutGroup(row.name);
    for (const char* group : kMatchingGroups) AddName(group + short_name, &row);
    return row;
  }

  // The value goes to COLMAP as it was checked here.
  OptionRow& PassOn(std::vector<ColmapSpelling> colmap, CheckedText text, const std::string& help) {
    const std::string& name = colmap.back().name.empty() ? colmap.front().name : colmap.back().name;
    std::map<std::string, std::string>* options = &line_->pipeline.verification.colmap_options;
    return PassOn(
        std::move(colmap), std::move(text),
        [options, key = name](const std::string& checked) { (*options)[key] = checked; }, help);
  }

  // It is stored in a field, from which COLMAP gets it if it is set.
  template <typename T>
  OptionRow& PassOn(std::vector<ColmapSpelling> colmap, CheckedText text, std::optional<T>* field,
                    const std::string& help) {
    return PassOn(
        std::move(colmap), std::move(text),
        [field](const std::string& checked) { Store(checked, field); }, help);
  }

  OptionRow& PassOn(std::vector<ColmapSpelling> colmap, CheckedText text,
                    const std::function<void(const std::string&)>& store, const std::string& help) {
    Value value;
    value.values = std::move(text.values);
    value.choices = std::move(text.choices);
    value.read = [store, check = std::move(text.check)](const std::string& given) {
      std::string checked = given;
      if (!check(&checked)) return false;
      store(checked);
      return true;
    };
    return AddGrouped(Use::kPassedOn, std::move(colmap), std::move(value), help);
  }

  void AddUnused(std::vector<ColmapSpelling> colmap, const std::string& why) {
    OptionRow& row = AddColmap(Use::kUnused, std::move(colmap), Anything(), why);
    if (EndsWith(row.name, "_path")) row.path = OptionRow::Path::kFile;
  }

  void AddGeneral();
  void AddGraph();
  void AddOtherStrategies();
  void AddVectors();
  void AddMatching();
  void AddWork();
  void AddEvaluation();
  void AddLog();
  void AddColmapMatching();
  void AddUnusedOptions();

  CommandLine* line_;
  const char* section_ = "";
  std::vector<OptionRow> rows_;
};

void Table::AddGeneral() {
  PipelineOptions& p = line_->pipeline;
  Section("General");
  Add("help", Flag(&line_->help), "print an example and the options that are used most")
      .names.emplace_back("h");
  Add("help-all", Flag(&line_->help_all), "print all options");
  Add("version", Flag(&line_->version), "print the version");
  AddColmap(Use::kHere, {{{3, 8}, "database_path", ""}},
            TextOf(&p.database_path, "the path of a COLMAP database"),
            "the COLMAP database with the features; the matches are written to it")
      .is_common = true;
  AddColmap(Use::kHere, {{{3, 8}, "project_path", ""}},
            TextOf(&line_->project_path, "the path of a file"),
            "an ini file with options, as COLMAP writes it; the command line goes before");
  Add("colmap_path", TextOf(&p.colmap_path, "a path, or a name on PATH", OptionRow::Path::kProgram),
      "the COLMAP program: a path, or a name on PATH")
      .is_common = true;
  AddColmap(
      Use::kHere, {{{3, 8}, "random_seed", "0"}, {{3, 13}, "default_random_seed", "0"}},
      SeedOf(&p.seed, &line_->seed_from_clock),
      "seed (>= 0) of this program's random choices, and handed on to COLMAP; -1: another one "
      "in every run");
}

void Table::AddGraph() {
  PipelineOptions& p = line_->pipeline;
  Section("GraphMatch: which pairs are tested");
  Add("GraphMatching.strategy", OneOf(&p.strategy, kStrategyWords),
      "which pairs are tested: best_first: the likeliest; graphmatch: those of the paper's loop; "
      "for comparison sampling or propagation (after one sampling) alone, retrieval: the nearest "
      "images of each, briad: retrieval and query expansion; exhaustive: all")
      .is_common = true;
  Add("GraphMatching.match_list_path", TextOf(&p.match_list_path, "the path of a list of pairs"),
      "a file of image pairs to be tested instead, two names a line")
      .is_common = true;
  AddColmap(Use::kHere, {{{3, 8}, "VocabTreeMatching.match_list_path", ""}},
            // COLMAP's default is an empty one.
            TextOrNothingOf(&p.image_list_path, "the path of a list of images"),
            "a file of image names, one a line: only these look for partners, among all images");
  const char kBestFirst[] = "--GraphMatching.strategy best_first";
  const auto is_best_first = [&p] { return p.RanksImages() && p.strategy == Strategy::kBestFirst; };
  AddFor(kBestFirst, is_best_first, "GraphMatching.goal", OneOf(&p.best_first.goal, kGoalWords),
         "edges: all of them; model: only those that a model gains by, which saves tests in dense "
         "scenes");
  AddFor(kBestFirst, is_best_first, "GraphMatching.min_edge_probability",
         DoubleOf(&p.best_first.min_edge_probability, Zero::kNotAllowed),
         "the run ends when no pair is as likely (> 0, < 1) to be an edge. Less finds weaker links "
         "and costs more tests")
      .is_common = true;
  Add("GraphMatching.max_pairs", CountOf(&p.budget.max_pairs),
      "pairs (>= 0) that the run may test, the most promising of each batch first; a later run "
      "goes on; 0: no limit");
  Add("GraphMatching.max_minutes", DoubleOf(&p.budget.max_minutes, Zero::kAllowed),
      "minutes (>= 0) after which no pair is tested any more, counted from the start; ranking the "
      "images is not cut short; 0: no limit")
      .is_common = true;
  Add("GraphMatching.dry_run", BoolOf(&line_->dry_run),
      "only rank the images: the first candidates are counted, and written by export_pairs; "
      "nothing "
      "is verified, nothing written to the database, and COLMAP is not run");
}

void Table::AddOtherStrategies() {
  PipelineOptions& p = line_->pipeline;
  Section("GraphMatch: the strategies graphmatch, retrieval and briad");
  const char kLoop[] = "--GraphMatching.strategy graphmatch";
  const auto is_loop = [&p] {
    return p.RanksImages() &&
           (p.strategy == Strategy::kGraphMatch || p.strategy == Strategy::kSampling ||
            p.strategy == Strategy::kPropagation);
  };
  AddFor(kLoop, is_loop, "GraphMatching.number_sample_iterations",
         IntOf(&p.graph.number_sample_iterations, 0),
         "iterations (>= 0) that sample before propagating; later ones only propagate");
  AddFor(kLoop, is_loop, "GraphMatching.max_tests_for_sampling",
         IntOf(&p.graph.max_tests_for_sampling, 0),
         "tests (>= 0) that sampling may spend on an image; 0: max(min(0.017 N, 120), 10) of N "
         "images. More finds weaker links and costs up to N tests for each");
  OptionRow& neighbors = AddFor(
      kLoop, is_loop, "GraphMatching.max_num_neighbors", IntOf(&p.graph.max_num_neighbors, 1),
      "neighbours (>= 1) after which an image looks for no more itself. Fewer thins dense "
      "scenes. VocabTreeMatching.num_images is another name for it, which to COLMAP means "
      "the images that are tested with each (100)");
  neighbors.use = Use::kHere;
  neighbors.colmap = {{{3, 8}, "VocabTreeMatching.num_images", "100"}};
  AddName("VocabTreeMatching.num_images", &neighbors);
  AddFor(kLoop, is_loop, "GraphMatching.num_to_propagate", IntOf(&p.graph.num_to_propagate, 0),
         "images (>= 0) that each neighbour hands on to an image in an iteration");
  AddFor(kLoop, is_loop, "GraphMatching.max_failed_samples", IntOf(&p.graph.max_failed_samples, 0),
         "draws (>= 0) of an image in a row that were no edges, after which it draws no more if "
         "it has a neighbour; 0: it spends its whole budget. 3 saves tests and loses few edges");
  AddFor(
      "--GraphMatching.strategy retrieval and briad",
      [&p] {
        return p.RanksImages() &&
               (p.strategy == Strategy::kRetrieval || p.strategy == Strategy::kBriad);
      },
      "GraphMatching.num_retrieved_images", IntOf(&p.num_retrieved_images, 0),
      "images (>= 1) that retrieval and briad test each image with; 0: 120, and 40 for briad");
  AddFor(
      "--GraphMatching.strategy briad",
      [&p] { return p.RanksImages() && p.strategy == Strategy::kBriad; },
      "GraphMatching.num_expansions", IntOf(&p.num_expansions, 0),
      "rounds (>= 0) of query expansion by briad");
}

void Table::AddVectors() {
  const PipelineOptions& p = line_->pipeline;
  ImageRankingOptions& ranking = line_->pipeline.ranking;
  ImageVectorOptions& vectors = ranking.vectors;
  Section("GraphMatch: how images are described");
  Add("GraphMatching.descriptor", OneOf(&vectors.descriptor, kDescriptorWords),
      "what describes an image: asmk: the visual words of its features; fisher: Fisher vectors of "
      "them; for comparison VLAD, GIST of the photo, or vectors of another program from a file");
  Add("image_path",
      TextOf(&vectors.image_path, "the path of a directory", OptionRow::Path::kDirectory),
      "the directory of the photos: to show them in the report, and for the descriptor gist")
      .is_common = true;
  Add("GraphMatching.vectors_path", TextOf(&vectors.vectors_path, "the path of a .npy file"),
      "for the descriptor file: a NumPy array, a row of float32 or float64 for each image; the "
      "images' names are in the file of the same name with .txt instead of .npy, one a line");
  Add("GraphMatching.export_vectors", TextOf(&ranking.export_path, "the path of a .npy file"),
      "write the vectors that were made to such files");
  const char kMixtures[] = "--GraphMatching.descriptor fisher and vlad";
  const auto has_mixture = [&p, &ranking, &vectors] {
    return p.RanksImages() && ranking.ranking_path.empty() &&
           (vectors.descriptor == Descriptor::kFisher || vectors.descriptor == Descriptor::kVlad);
  };
  AddFor(
      kMixtures, has_mixture, "GraphMatching.pca_dim", IntOf(&vectors.pca_dim, 0),
      "dimensions (1 to 128) that the features are reduced to before the mixture; 0: not reduced");
  AddFor(kMixtures, has_mixture, "GraphMatching.num_components",
         IntOf(&vectors.gmm.num_components, 1),
         "Gaussians (>= 1) of the mixture; time and memory grow in proportion");
  AddFor(kMixtures, has_mixture, "GraphMatching.max_num_features",
         IntOf(&vectors.max_num_features, 1),
         "features (>= 1) of an image that are encoded at most, those of the largest scales");
  AddFor(kMixtures, has_mixture, "GraphMatching.num_training_descriptors",
         IntOf(&vectors.num_training_descriptors, 1),
         "descriptors (>= 1) that the mixture is learnt from");
  Add("GraphMatching.ranking_path", TextOf(&ranking.ranking_path, "the path of ranked lists"),
      "a file of ranked images instead, e.g. of a vocabulary tree: image, other image and score a "
      "line, separated by tabs; greater scores are nearer");
}

void Table::AddMatching() {
  PipelineOptions& p = line_->pipeline;
  ExactMatcherOptions& exact = p.verification.exact;
  Section("GraphMatch: how descriptors are matched");
  Add("GraphMatching.matcher", OneOf(&p.verification.matcher, kMatcherWords),
      "exact: by this program; colmap: by COLMAP; auto: by COLMAP if it has a GPU and use_gpu is "
      "on, else exact");
  Add("GraphMatching.verifier", OneOf(&p.verification.verifier, kVerifierWords),
      "colmap: COLMAP's geometric verification; screened: the same, after a fast fit that settles "
      "hopeless pairs and leaves COLMAP the likely matches; native: by this program, without "
      "COLMAP; auto: screened, or native where there is no COLMAP");
  Add("GraphMatching.cache_gb", DoubleOf(&exact.cache_gb, Zero::kAllowed),
      "GB (>= 0) of descriptors kept in memory; 0: a quarter of the memory. Less reads images more "
      "often");
}

void Table::AddWork() {
  PipelineOptions& p = line_->pipeline;
  Section("GraphMatch: how COLMAP is run");
  Add("GraphMatching.num_processes", IntOf(&p.verification.num_processes, 0),
      "COLMAP processes at a time; 0: one a core without a GPU, else one");
  Add("GraphMatching.max_pairs_per_shard", IntOf(&p.verification.max_pairs_per_shard, 1),
      "pairs (>= 1) that COLMAP gets at a time; kill -9 loses at most so many verified pairs a "
      "process");
  Add("GraphMatching.timeout_per_pair",
      DoubleOf(&p.verification.timeout_per_pair, Zero::kNotAllowed),
      "seconds (> 0) a pair after which COLMAP counts as hanging");
  Add("GraphMatching.lock_timeout", DoubleOf(&p.verification.lock_timeout, Zero::kAllowed),
      "seconds (>= 0) to wait while another program locks the database");
  Add("GraphMatching.work_path",
      TextOf(&p.work_path, "the path of a directory", OptionRow::Path::kDirectory),
      "where temporary files go (default: $TMPDIR or /tmp); some 100 MB a process");
}

void Table::AddEvaluation() {
  PipelineOptions& p = line_->pipeline;
  Section("GraphMatch: what a run tells, and how it is compared with others");
  Add("GraphMatching.report", TextOf(&line_->report_path, "the path of a file"),
      "a page (.html, and the same as .json beside it) or a JSON file to write with what was "
      "found, what it cost, and what is wrong with images that match nothing. With --image_path "
      "the page shows the photos")
      .is_common = true;
  Add("GraphMatching.export_pairs", TextOf(&line_->pair_list_path, "the path of a file"),
      "write the edges, those with the most inliers first, as a list of pairs as COLMAP and hloc "
      "read it; in a dry run the candidates, nearest first");
  Add("GraphMatching.export_graph", TextOf(&line_->graph_path, "the path of a file"),
      "write the matching graph as GraphML, or for Graphviz (.dot)");
  Add("GraphMatching.pair_log", TextOf(&p.pair_log_path, "the path of a file"),
      "a CSV file to write with every pair that is tested");
  Add("GraphMatching.replay_path",
      TextOf(&p.replay_path, "the path of a matched COLMAP database or a list of edges"),
      "a finished matching graph that answers instead of COLMAP, to compare options in seconds: a "
      "matched COLMAP database, or lines of two images and their inliers, separated by tabs. "
      "Nothing is written to the database");
}

void Table::AddLog() {
  LogOptions& log = line_->log;
  Section("What is printed");
  Add("GraphMatching.quiet", BoolOf(&log.quiet),
      "print nothing but warnings and errors: no progress and no summary");
  AddColmap(Use::kHere, {{{4, 0}, "log_severity", "0"}}, IntOf(&log.severity, 0, 3),
            "the least severity that is logged; 0: info, 1: warnings, 2 and 3: errors. The block "
            "of progress on a terminal and the summary stay");
  AddColmap(Use::kHere, {{{3, 8}, "log_level", "2"}, {{3, 9}, "log_level", "0"}},
            IntOf(&log.verbosity, 0),
            "how much is logged; from 3 on every stage of every iteration has a line");
  AddColmap(Use::kHere, {{{4, 0}, "log_target", "stderr_and_file"}},
            OneOf(&log.target, kLogTargetWords),
            "where the log goes: the standard error output, and with log_path that file. Errors "
            "that end the program are on the standard error output in any case");
  AddColmap(Use::kHere, {{{4, 0}, "log_path", ""}},
            TextOrNothingOf(&log.path, "the path of a file, or of where it goes"),
            "the file to which the log is appended; of a directory graphmatch_matcher.log in it");
  AddColmap(Use::kHere,
            {{{3, 8}, "log_to_stderr", "0"}, {{3, 9}, "log_to_stderr", "1"}, {{4, 0}, "", ""}},
            BoolOf(&line_->log_to_stderr),
            "0 with log_path: log to that file alone; without it no effect");
  AddColmap(Use::kHere, {{{4, 0}, "log_color", "1"}}, BoolOf(&log.color),
            "colours on a terminal, unless the environment variable NO_COLOR is set");
}

void Table::AddColmapMatching() {
  PipelineOptions& p = line_->pipeline;
  DescriptorMatchingOptions& matching = p.verification.exact.matching;
  GeometryOptions& geometry = p.verification.geometry;
  Section(
      "COLMAP's options of matching and verification, accepted in each of the groups "
      "SiftMatching, TwoViewGeometry and FeatureMatching");
  AddGrouped(Use::kHere,
             {{{3, 8}, "SiftMatching.use_gpu", "1"}, {{3, 13}, "FeatureMatching.use_gpu", "1"}},
             BoolOf(&p.verification.use_gpu), "match on the GPU if the installed COLMAP can")
      .is_common = true;
  PassOn({{{3, 8}, "SiftMatching.gpu_index", "-1"}, {{3, 13}, "FeatureMatching.gpu_index", "-1"}},
         AnyText(), "which GPUs, e.g. 0,1; -1: all");
  AddGrouped(
      Use::kHere,
      {{{3, 8}, "SiftMatching.num_threads", "-1"}, {{3, 13}, "FeatureMatching.num_threads", "-1"}},
      NumThreadsOf(&p.num_threads), "cores to use at a time, COLMAP's included; below 1: all")
      .is_common = true;
  AddGrouped(Use::kHere,
             {{{3, 13}, "FeatureMatching.type", "SIFT"},
              {{4, 0}, "FeatureMatching.type", "SIFT_BRUTEFORCE"}},
             FeatureTypeOf(&line_->lightglue),
             "how descriptors are matched; SIFT_LIGHTGLUE: by COLMAP 4");
  AddGrouped(Use::kHere, {{{3, 8}, "SiftMatching.max_ratio", "0.8"}},
             DoubleOf(&matching.max_ratio, Zero::kNotAllowed),
             "greatest ratio of the angles to the best and the second best match");
  AddGrouped(Use::kHere, {{{3, 8}, "SiftMatching.max_distance", "0.7"}},
             DoubleOf(&matching.max_distance, Zero::kNotAllowed),
             "greatest angle to the best match, in radians");
  AddGrouped(Use::kHere, {{{3, 8}, "SiftMatching.cross_check", "1"}}, BoolOf(&matching.cross_check),
             "keep a match only if it is the best in both directions");
  AddGrouped(Use::kHere,
             {{{3, 8}, "SiftMatching.max_num_matches", "32768"},
              {{3, 13}, "FeatureMatching.max_num_matches", "32768"}},
             IntOf(&matching.max_num_matches, 1), "features of an image that are matched at most");
  PassOn({{{3, 8}, "SiftMatching.guided_matching", "0"},
          {{3, 13}, "FeatureMatching.guided_matching", "0"}},
         BoolText(), &geometry.guided_matching,
         "match again along the epipolar geometry that was found");
  AddGrouped(Use::kHere,
             {{{3, 8}, "SiftMatching.min_num_inliers", "15"},
              {{3, 9}, "TwoViewGeometry.min_num_inliers", "15"}},
             IntOf(&p.verification.geometry.min_num_inliers, 0),
             "inliers that make a pair an edge");
  PassOn({{{3, 8}, "SiftMatching.max_error", "4"}, {{3, 9}, "TwoViewGeometry.max_error", "4"}},
         PositiveText(), &geometry.max_error, "greatest epipolar error of an inlier, in pixels");
  PassOn({{{3, 8}, "SiftMatching.confidence", "0.999"},
          {{3, 9}, "TwoViewGeometry.confidence", "0.999"}},
         ShareText(), &geometry.confidence, "confidence of RANSAC");
  PassOn({{{3, 8}, "SiftMatching.max_num_trials", "10000"},
          {{3, 9}, "TwoViewGeometry.max_num_trials", "10000"}},
         IntText(30), &geometry.max_num_trials, "trials of RANSAC at most");
  PassOn({{{3, 8}, "SiftMatching.min_inlier_ratio", "0.25"},
          {{3, 9}, "TwoViewGeometry.min_inlier_ratio", "0.25"},
          {{4, 2}, "TwoViewGeometry.min_inlier_ratio", "0"}},
         ShareText(), &geometry.min_inlier_ratio, "inlier ratio that RANSAC counts on");
  PassOn({{{3, 8}, "SiftMatching.multiple_models", "0"},
          {{3, 9}, "TwoViewGeometry.multiple_models", "0"}},
         BoolText(), &geometry.multiple_models, "look for several motions in a pair");
  PassOn({{{3, 8}, "SiftMatching.compute_relative_pose", "0"},
          {{3, 9}, "TwoViewGeometry.compute_relative_pose", "0"}},
         BoolText(), &geometry.compute_relative_pose, "store the relative pose as well");
  PassOn({{{3, 8}, "SiftMatching.planar_scene", "0"}, {{3, 9}, "", ""}}, BoolText(),
         &geometry.planar_scene, "the scene is planar");
  PassOn({{{3, 12}, "SiftMatching.cpu_brute_force_matcher", "0"}}, BoolText(),
         "match exactly where COLMAP matches without a GPU; much slower");
  PassOn({{{3, 13}, "TwoViewGeometry.detect_watermark", "1"}}, BoolText(),
         &geometry.detect_watermark, "mark pairs that only a watermark links");
  PassOn({{{3, 13}, "TwoViewGeometry.multiple_ignore_watermark", "1"}}, BoolText(),
         &geometry.multiple_ignore_watermark, "leave watermarks out of several motions");
  PassOn({{{3, 13}, "TwoViewGeometry.watermark_detection_max_error", "4"}}, PositiveText(),
         &geometry.watermark_detection_max_error,
         "greatest error of a watermark's inlier, in pixels");
  PassOn({{{3, 13}, "TwoViewGeometry.filter_stationary_matches", "0"}}, BoolText(),
         &geometry.filter_stationary_matches, "drop matches at the same place in both images");
  PassOn({{{3, 13}, "TwoViewGeometry.stationary_matches_max_error", "4"}}, PositiveText(),
         &geometry.stationary_matches_max_error, "what the same place means, in pixels");
  PassOn({{{3, 13}, "TwoViewGeometry.random_seed", "-1"}}, IntText(-1), &geometry.random_seed,
         "seed of RANSAC, the same for every pair; -1: of the thread");
  PassOn({{{4, 2}, "TwoViewGeometry.use_degensac", "0"}}, BoolText(), &geometry.use_degensac,
         "use DEGENSAC");
  PassOn({{{4, 2}, "TwoViewGeometry.use_sampson_refinement", "1"}}, BoolText(),
         &geometry.use_sampson_refinement, "refine by Sampson errors");
  AddGrouped(Use::kHere, {{{4, 0}, "FeatureMatching.skip_image_pairs_in_same_frame", "0"}},
             BoolOf(&p.skip_image_pairs_in_same_frame),
             "do not test pairs of images that a rig took at the same time");
  PassOn({{{4, 0}, "SiftMatching.lightglue_min_score", "0.1"}}, ShareText(),
         "score of a match by LightGlue");
  PassOn({{{4, 0}, "SiftMatching.lightglue_model_path", ""}}, AnyText(), "the model of LightGlue")
      .path = OptionRow::Path::kFile;
}

void Table::AddUnusedOptions() {
  Section("Accepted without effect");
  const char* tree = "there is no vocabulary tree";
  AddUnused({{{3, 8}, "VocabTreeMatching.vocab_tree_path", ""}}, tree);
  AddUnused({{{3, 8}, "VocabTreeMatching.num_nearest_neighbors", "5"}}, tree);
  AddUnused({{{3, 8}, "VocabTreeMatching.num_checks", "256"},
             {{3, 13}, "VocabTreeMatching.num_checks", "64"}},
            tree);
  AddUnused({{{3, 8}, "VocabTreeMatching.num_images_after_verification", "0"}}, tree);
  AddUnused({{{3, 8}, "VocabTreeMatching.max_num_features", "-1"}}, tree);
  AddUnused({{{3, 12}, "VocabTreeMatching.num_threads", "-1"}}, tree);
  AddUnused({{{4, 0}, "FeatureMatching.skip_geometric_verification", "0"}},
            "pairs are found by verifying them");
  AddUnused({{{3, 13}, "FeatureMatching.rig_verification", "0"}},
            "verify rigs afterwards with `colmap geometric_verifier`");

  using NamesAndDefaults = std::vector<std::pair<const char*, const char*>>;
  const char* sift = "only SIFT features are matched";
  for (const auto& [name, default_value] : NamesAndDefaults{{"brute_force_min_cossim", "0.85"},
                                                            {"brute_force_max_ratio", "1"},
                                                            {"brute_force_cross_check", "1"},
                                                            {"bruteforce_model_path", ""},
                                                            {"lightglue_min_score", "0.1"},
                                                            {"lightglue_model_path", ""}}) {
    AddUnused({{{4, 0}, std::string("AlikedMatching.") + name, default_value}}, sift);
  }
  for (const auto& [name, default_value] : NamesAndDefaults{{"min_score", "0.1"},
                                                            {"use_bf16", "0"},
                                                            {"b_model_path", ""},
                                                            {"b_model_path_bf16", ""},
                                                            {"b128_model_path", ""},
                                                            {"b128_model_path_bf16", ""},
                                                            {"r_model_path", ""},
                                                            {"r_model_path_bf16", ""},
                                                            {"l_model_path", ""},
                                                            {"l_model_path_bf16", ""},
                                                            {"g_model_path", ""},
                                                            {"g_model_path_bf16", ""},
                                                            {"brute_force_min_cossim", "0.85"},
                                                            {"brute_force_max_ratio", "1"},
                                                            {"brute_force_cross_check", "1"},
                                                            {"brute_force_model_path", ""}}) {
    AddUnused({{{4, 2}, std::string("LomaMatching.") + name, default_value}}, sift);
  }
}

}  // namespace

const ColmapSpelling* OptionRow::In(const ColmapVersion& version) const {
  const ColmapSpelling* found = nullptr;
  for (const ColmapSpelling& spelling : colmap) {
    if (!(version < spelling.first)) found = &spelling;
  }
  return found == nullptr || found->name.empty() ? nullptr : found;
}

std::string OptionRow::ColmapDefaults() const {
  std::string text = "COLMAP";
  const ColmapSpelling& oldest = colmap.front();
  if (ColmapVersion{3, 8} < oldest.first) text += " since " + ToString(oldest.first);
  if (colmap.back().name.empty()) text += " before " + ToString(colmap.back().first);
  text += ": " + (oldest.default_value.empty() ? "none" : oldest.default_value);
  std::string last = oldest.default_value;
  for (const ColmapSpelling& spelling : colmap) {
    if (spelling.name.empty() || spelling.default_value == last) continue;
    last = spelling.default_value;
    text += "; since " + ToString(spelling.first) + ": " + last;
  }
  return text;
}

std::string WithDashes(const std::string& name) { return (name.size() == 1 ? "-" : "--") + name; }

std::string ToString(const ColmapVersion& version) {
  return fmt::format("{}.{}", version.major, version.minor);
}

std::vector<OptionRow> MakeOptionTable(CommandLine* line) { return Table(line).Make(); }

}  // namespace colmap_graphmatch
