#pragma once

namespace colmap_graphmatch {

// Exit codes of graphmatch_matcher, listed in docs/errors.md. Whatever the code, all pairs verified
// before are in the database.
enum ExitCode : int {
  kExitSuccess = 0,
  kExitOptions = 1,
  kExitDatabase = 2,
  kExitDatabaseLocked = 3,
  kExitColmap = 4,
  kExitFile = 5,
  kExitInternal = 70,
  kExitInterrupted = 130,  // As a shell reports a program that SIGINT ended.
};

}  // namespace colmap_graphmatch
