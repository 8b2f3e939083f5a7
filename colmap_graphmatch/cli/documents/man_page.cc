#include <algorithm>
#include <cctype>
#include <map>
#include <ostream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/version.h"
#include "colmap_graphmatch/cli/documents/documents.h"
#include "colmap_graphmatch/cli/exit_codes.h"
#include "colmap_graphmatch/cli/option_table.h"
#include "colmap_graphmatch/cli/options.h"

namespace colmap_graphmatch {
namespace {

constexpr std::size_t kLineLength = 78;

// Text as roff reads it: what stands between backticks is bold, and there a hyphen is one to be
// copied; so is a minus sign.
std::string Roff(const std::string& text) {
  std::string roff;
  bool bold = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool before_digit =
        i + 1 < text.size() && std::isdigit(static_cast<unsigned char>(text[i + 1])) != 0;
    if (c == '`') {
      bold = !bold;
      roff += bold ? "\\fB" : "\\fR";
    } else if (c == '\\') {
      roff += "\\e";
    } else if (c == '-' && (bold || before_digit)) {
      roff += "\\-";
    } else {
      roff += c;
    }
  }
  return roff;
}

// Prose in lines of their usual length, every sentence on a line of its own.
void PrintText(std::ostream& stream, const std::string& text) {
  std::istringstream words(Roff(text));
  std::string line;
  const auto flush = [&] {
    if (line.empty()) return;
    // A line that begins like this would be a request.
    const bool is_request = line.front() == '.' || line.front() == '\'';
    stream << (is_request ? "\\&" : "") << line << '\n';
    line.clear();
  };
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > kLineLength) flush();
    line += (line.empty() ? "" : " ") + word;
    if (word.back() == '.' || word.back() == ':') flush();
  }
  flush();
}

void PrintItem(std::ostream& stream, const std::string& tag, const std::string& text) {
  stream << ".TP\n" << Roff(tag) << '\n';
  PrintText(stream, text);
}

// Commands that a shell would take as they are.
void PrintCommands(std::ostream& stream, const std::vector<std::string>& lines) {
  stream << ".PP\n.RS 4\n.nf\n";
  for (const std::string& line : lines) stream << Roff("`" + line + "`") << '\n';
  stream << ".fi\n.RE\n";
}

std::string Sentence(std::string text) {
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text.back() == '.' ? text : text + ".";
}

std::string Names(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "`" : ", `") + WithDashes(name) + "`";
  }
  return text;
}

void PrintOption(std::ostream& stream, const OptionRow& row) {
  std::string tag = "`" + WithDashes(row.name) + "`";
  std::vector<std::string> other_names(row.names.begin() + 1, row.names.end());
  if (row.values.empty()) {
    if (!other_names.empty()) tag += ", " + Names(std::exchange(other_names, {}));
    PrintItem(stream, tag, Sentence(row.help));
    return;
  }
  std::string text = Sentence(row.help) + " The value is " + row.values;
  if (row.use == OptionRow::Use::kPassedOn) {
    text += "; by default it is COLMAP's own (" + row.ColmapDefaults() + ")";
  } else if (!row.default_value.empty()) {
    text += "; by default it is `" + row.default_value + "`";
  }
  text += ".";
  if (!other_names.empty()) text += " Other names: " + Names(other_names) + ".";
  stream << ".TP\n" << Roff(tag) << " \\fIvalue\\fR\n";
  PrintText(stream, text);
}

void PrintOptions(std::ostream& stream) {
  stream << ".SH OPTIONS\n";
  PrintText(stream,
            "Every option of `colmap vocab_tree_matcher` of COLMAP 3.8 to 4.2 is accepted, under "
            "the name that any version has for it. An option may be shortened as long as no other "
            "begins like that, and its value may follow after a space or an equals sign. For the "
            "values `0` and `1` other words for true and false will do.");
  CommandLine defaults;
  std::string section;
  std::map<std::string, std::vector<std::string>> unused;  // Names by what is said of them.
  for (const OptionRow& row : MakeOptionTable(&defaults)) {
    if (row.section != section) {
      section = row.section;
      stream << ".SS " << Roff(section) << '\n';
    }
    if (row.use == OptionRow::Use::kUnused) {
      std::vector<std::string>& names = unused[row.help];
      names.insert(names.end(), row.names.begin(), row.names.end());
    } else {
      PrintOption(stream, row);
    }
  }
  for (const auto& [reason, names] : unused) {
    PrintItem(stream, Names(names), Sentence(reason));
  }
}

void PrintExitStatus(std::ostream& stream) {
  stream << ".SH EXIT STATUS\n";
  const std::vector<std::pair<ExitCode, const char*>> meanings = {
      {kExitSuccess, "Done, or the budget is used up; warnings name pairs that COLMAP failed on."},
      {kExitOptions, "An option is wrong."},
      {kExitDatabase,
       "The database is missing, not COLMAP's, damaged, without images or features, or cannot be "
       "written."},
      {kExitDatabaseLocked,
       "Another program kept the database locked for `--GraphMatching.lock_timeout` seconds."},
      {kExitColmap, "COLMAP is missing, older than 3.8, or fails on everything."},
      {kExitFile,
       "The directory for temporary files cannot be used, or its disk is full, or a file cannot be "
       "read (a list of pairs or images) or written (report, exports, logs)."},
      {kExitInternal, "Out of memory, or a fault of this program."},
      {kExitInterrupted, "Stopped by Ctrl-C, SIGTERM or SIGHUP; the same command goes on."}};
  for (const auto& [code, meaning] : meanings) {
    PrintItem(stream, "`" + std::to_string(code) + "`", meaning);
  }
  stream << ".PP\n";
  PrintText(stream, "Whatever the code, all pairs that were verified before are in the database.");
}

}  // namespace

void PrintManPage(std::ostream& stream, const std::string& date) {
  stream << ".\\\" Written when the program is built, from its table of options.\n"
         << ".TH GRAPHMATCH_MATCHER 1 " << date << " \"colmap\\-graphmatch " << kVersion
         << "\" \"User Commands\"\n"
         << ".SH NAME\n"
            "graphmatch_matcher \\- find and match photos of the same place, for COLMAP\n"
            ".SH SYNOPSIS\n"
            ".B graphmatch_matcher\n"
            ".B \\-\\-database_path\n"
            ".I database\n"
            ".RI [ option\n"
            ".IR value ]...\n"
            ".br\n"
            ".B graphmatch_matcher\n"
            ".BR \\-\\-help | \\-\\-help\\-all | \\-\\-version\n"
            ".SH DESCRIPTION\n";
  PrintText(stream,
            "`graphmatch_matcher` finds which images of a COLMAP database show the same place, "
            "matches their features, has COLMAP verify the pairs, and writes matches and two-view "
            "geometries to the database, ready for `colmap mapper`. It takes the place of `colmap "
            "vocab_tree_matcher` and needs no vocabulary tree.");
  stream << ".PP\n";
  PrintText(stream,
            "Each image is described by visual words that are learnt from the collection itself. "
            "Sampling tests the images that look most alike, propagation the neighbours of those "
            "that matched. Of both the likeliest pairs are tested next, as far as the tests before "
            "tell, until no pair is likely.");
  stream << ".PP\n";
  PrintText(stream,
            "A run that was interrupted goes on when the same command is given again, and no pair "
            "is tested twice. After new images were added, the same command tests them alone, and "
            "what they lead to.");
  PrintOptions(stream);
  PrintExitStatus(stream);
  stream << ".SH ENVIRONMENT\n";
  PrintItem(stream, "`PATH`",
            "Where COLMAP is looked for, unless `--colmap_path` says where it is.");
  PrintItem(stream, "`TMPDIR`",
            "The directory for temporary files, unless `--GraphMatching.work_path` names one; "
            "`/tmp` if it is not set.");
  PrintItem(stream, "`NO_COLOR`", "If it is set and not empty, nothing is printed in colour.");
  PrintItem(stream, "`TERM`",
            "With `dumb`, or where the standard error output is no terminal, progress is told in "
            "lines of the log instead of a block that is redrawn.");
  stream << ".SH FILES\n";
  stream << ".TP\n.I database\n";
  PrintText(stream,
            "A COLMAP database with the features of the images. Matches and two-view geometries "
            "are written to it.");
  stream << ".TP\n.IB database .graphmatch\n";
  PrintText(stream,
            "What a later run needs again: the mixture, the vectors of the images, and where the "
            "run began. It can be deleted while no run is at work.");
  stream << ".SH EXAMPLES\n";
  PrintText(
      stream,
      "From photos to sparse models (with a GPU and a COLMAP that was built for it, leave out "
      "`use_gpu`):");
  PrintCommands(
      stream,
      {"colmap feature_extractor --database_path database.db --image_path images \\",
       "    --SiftExtraction.use_gpu 0", "graphmatch_matcher --database_path database.db",
       "mkdir -p sparse",
       "colmap mapper --database_path database.db --image_path images --output_path sparse"});
  stream << ".PP\n";
  PrintText(stream, "On four cores, without a GPU, and with a page that shows what was found:");
  PrintCommands(stream, {"graphmatch_matcher --database_path database.db \\",
                         "    --FeatureMatching.num_threads 4 --FeatureMatching.use_gpu 0 \\",
                         "    --image_path images --GraphMatching.report report.html"});
  stream << ".PP\n";
  PrintText(stream, "Half an hour at most; the same command then goes on:");
  PrintCommands(stream, {"graphmatch_matcher --database_path database.db \\",
                         "    --GraphMatching.max_minutes 30"});
  stream << ".PP\n";
  PrintText(stream, "The pairs of a list, two names a line, instead of those that it would find:");
  PrintCommands(stream, {"graphmatch_matcher --database_path database.db \\",
                         "    --GraphMatching.match_list_path pairs.txt"});
  stream << ".SH SEE ALSO\n"
            ".BR colmap (1)\n";
}

}  // namespace colmap_graphmatch
