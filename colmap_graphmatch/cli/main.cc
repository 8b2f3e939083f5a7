#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <iostream>
#include <map>
#include <memory>
#include <new>
#include <string>
#include <variant>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/output_file.h"
#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/version.h"
#include "colmap_graphmatch/cli/console.h"
#include "colmap_graphmatch/cli/exit_codes.h"
#include "colmap_graphmatch/cli/options.h"
#include "colmap_graphmatch/cli/run_files.h"
#include "colmap_graphmatch/cli/summary.h"
#include "colmap_graphmatch/colmap_graphmatch.h"
#include "colmap_graphmatch/report/exports.h"
#include "colmap_graphmatch/report/html_report.h"
#include "colmap_graphmatch/report/json_report.h"
#include "colmap_graphmatch/report/report_data.h"
#include "colmap_graphmatch/report/thumbnails.h"

namespace colmap_graphmatch {
namespace {

StopRequest stop_request;
std::atomic<Console*> signalled_console{nullptr};
static_assert(std::atomic<Console*>::is_always_lock_free);

void HandleSignal(int signal) {
  Console* console = signalled_console;
  if (signal == SIGCONT) {
    if (console != nullptr) console->NoteContinue();
    return;
  }
  if (stop_request.Abandon()) {
    // Asked for the third time: whatever it is that does not end, the database can do without it.
    std::signal(signal, SIG_DFL);
    ::raise(signal);
    return;
  }
  stop_request.Raise();
  if (console != nullptr) console->NoteInterrupt();
}

void HandleSignals() {
  struct sigaction action = {};
  action.sa_handler = HandleSignal;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGCONT, &action, nullptr);
  // The soft limit of CPU time: some seconds are left.
  ::sigaction(SIGXCPU, &action, nullptr);
  // The terminal is gone; with nohup the signal is ignored already and stays so.
  struct sigaction hangup = {};
  ::sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);
  // Output that nobody reads any more must not end a run of hours, and a file that may grow no
  // larger is an error like others.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

// A standard stream that is closed: its number would go to the next file that is opened, and what
// is printed into that file. This one can be neither read nor written to, as if it were closed.
void FillStandardStreams() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(number, F_GETFD) >= 0 || errno != EBADF) continue;
    const int mode = number == STDIN_FILENO ? O_WRONLY : O_RDONLY;
    if (::open("/dev/null", mode) < 0) ::open("/", O_RDONLY);
  }
}

// A umask that takes rights from the owner would take this program's own files from it.
void KeepOwnFilesUsable() {
  const mode_t others = S_IRWXG | S_IRWXO;
  ::umask(::umask(others) & others);
}

// For as long as it lives, the console is told of signals.
class SignalledConsole {
 public:
  explicit SignalledConsole(Console* console) { signalled_console = console; }
  ~SignalledConsole() { signalled_console = nullptr; }
  SignalledConsole(const SignalledConsole&) = delete;
  SignalledConsole& operator=(const SignalledConsole&) = delete;
};

// Results are in the database, and a full disk under the standard output changes nothing about
// that: no reason for another exit code, but for a word.
void WarnIfNotWritten(const std::ostream& stream, Console& console) {
  if (stream) return;
  console.OnWarning(std::string("The standard output could not be written: ") +
                    std::strerror(errno) + ". Nothing else is lost.");
}

// The photos that the page shows, as far as they can be read.
std::map<std::size_t, std::string> FindPhotos(const CommandLine& line, const ReportData& data,
                                              Console& console) {
  const std::filesystem::path& image_path = line.pipeline.ranking.vectors.image_path;
  if (image_path.empty() || !data.details) return {};
  ThreadPool threads(line.pipeline.num_threads);
  const auto wanted = ChooseThumbnails(*data.details);
  auto thumbnails = MakeThumbnails(image_path, wanted, threads, stop_request);
  if (thumbnails.size() < wanted.size() && !stop_request.Requested()) {
    console.OnWarning(std::to_string(wanted.size() - thumbnails.size()) + " of " +
                      std::to_string(wanted.size()) + " photos could not be read in " +
                      image_path.string() + " and are not in the report.");
  }
  return thumbnails;
}

void WriteReport(const CommandLine& line, const PipelineResult& result, Console& console) {
  const ReportData data = MakeReportData(line.pipeline, result);
  const std::string json = MakeJsonReport(data);
  WriteWholeFile(JsonReportPath(line.report_path), [&](std::ostream& file) { file << json; });
  if (!IsPage(line.report_path)) return;
  const auto photos = FindPhotos(line, data, console);
  WriteWholeFile(line.report_path,
                 [&](std::ostream& file) { file << MakeHtmlReport(json, photos); });
}

void WarnOfNames(const CommandLine& line, const PairListNames& names, Console& console) {
  if (names.any_spaces) {
    console.OnWarning("Some names of images have spaces: lines of " + line.pair_list_path.string() +
                      " with such a name have a tab between the names, and COLMAP and hloc cannot "
                      "read them; --GraphMatching.match_list_path can.");
  }
  if (names.num_left_out > 0) {
    console.OnWarning(std::to_string(names.num_left_out) + " pairs are not in " +
                      line.pair_list_path.string() +
                      ": the names of their images have line ends or tabs, which no list can "
                      "hold.");
  }
}

// The files that were asked for.
void WriteFiles(const CommandLine& line, const PipelineResult& result, Console& console) {
  if (!line.report_path.empty()) WriteReport(line, result, console);
  if (!result.details) return;
  if (!line.pair_list_path.empty()) {
    WarnOfNames(line, WritePairList(line.pair_list_path, *result.details), console);
  }
  if (!line.graph_path.empty()) WriteGraph(line.graph_path, *result.details);
}

void PrintSummary(const CommandLine& line, const std::string& summary, Console& console) {
  console.EndProgress();
  if (line.log.quiet) return;
  std::cout << summary << std::flush;
  WarnIfNotWritten(std::cout, console);
}

void ShowCandidates(const CommandLine& line, Console& console) {
  const CandidateList candidates = FindCandidates(line.pipeline, stop_request, console);
  PrintSummary(line, FormatSummary(candidates), console);
  if (line.pair_list_path.empty()) return;
  WarnOfNames(line, WritePairList(line.pair_list_path, candidates), console);
}

// Whether COLMAP failed on every pair that it was given; then it has been said.
bool HasColmapFailed(const PipelineResult& result, Console& console) {
  const auto* cost = std::get_if<VerificationCost>(&result.cost);
  if (cost == nullptr || cost->num_failed == 0 || cost->num_verified > 0 ||
      result.stopped_by == PipelineResult::StoppedBy::kRequest) {
    return false;
  }
  console.Error("COLMAP failed on all " + std::to_string(cost->num_failed) +
                " pairs that it was given; the warnings above say how. They stay untested.");
  return true;
}

int Run(const CommandLine& line, Console& console) {
  const SignalledConsole signalled(&console);
  for (const std::string& message : line.unused_options) console.OnInfo(message);
  for (const std::string& warning : line.warnings) console.OnWarning(warning);
  try {
    CheckOutputs(FilesOfRun(line));
    if (line.dry_run) {
      ShowCandidates(line, console);
      return kExitSuccess;
    }
    const PipelineResult result = RunPipeline(line.pipeline, stop_request, console);
    PrintSummary(line, FormatSummary(line.pipeline, result), console);
    WriteFiles(line, result, console);
    if (HasColmapFailed(result, console)) return kExitColmap;
    if (result.matching.finished) return kExitSuccess;
    if (result.stopped_by != PipelineResult::StoppedBy::kRequest) {
      console.OnInfo(
          "The budget is used up. Everything verified so far is in the database; the same command "
          "goes on from here, with the same budget anew.");
      return kExitSuccess;
    }
  } catch (const StoppedError&) {
    // Before the first pair: there is nothing to sum up.
  }
  console.OnInfo(line.pipeline.replay_path.empty()
                     ? "Stopped as asked. What was tested is in the database; run the same command "
                       "again to go on from here."
                     : "Stopped as asked.");
  return kExitInterrupted;
}

int Main(int argc, const char* const* argv) {
  HandleSignals();
  FillStandardStreams();
  KeepOwnFilesUsable();
  // Until it is known what the user wants.
  auto console = std::make_unique<Console>(LogOptions());
  const auto fail = [&](const char* message, ExitCode code) {
    console->Error(message);
    return code;
  };
  try {
    const CommandLine line = ParseCommandLine(argc, argv, &stop_request);
    if (line.help || line.help_all) {
      (line.help_all ? PrintFullHelp : PrintHelp)(std::cout);
      WarnIfNotWritten(std::cout.flush(), *console);
      return kExitSuccess;
    }
    if (line.version) {
      std::cout << "graphmatch_matcher " << kVersion << std::endl;
      WarnIfNotWritten(std::cout, *console);
      return kExitSuccess;
    }
    console = std::make_unique<Console>(line.log);
    return Run(line, *console);
  } catch (const OptionsError& error) {
    return fail(error.what(), kExitOptions);
  } catch (const DatabaseLockedError& error) {
    return fail(error.what(), kExitDatabaseLocked);
  } catch (const DatabaseError& error) {
    return fail(error.what(), kExitDatabase);
  } catch (const ColmapError& error) {
    return fail(error.what(), kExitColmap);
  } catch (const FileError& error) {
    return fail(error.what(), kExitFile);
  } catch (const SystemLimitError& error) {
    return fail(error.what(), kExitFile);
  } catch (const StoppedError&) {
    console->OnInfo("Stopped as asked.");
    return kExitInterrupted;
  } catch (const std::bad_alloc&) {
    return fail("out of memory. What was verified before is in the database.", kExitInternal);
  } catch (const std::exception& error) {
    return fail(error.what(), kExitInternal);
  }
}

}  // namespace
}  // namespace colmap_graphmatch

int main(int argc, char** argv) { return colmap_graphmatch::Main(argc, argv); }
