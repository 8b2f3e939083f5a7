#include <sqlite3.h>
#include <sys/resource.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/database/lock_holder.h"
#include "colmap_graphmatch/database/sqlite.h"
#include "colmap_graphmatch/database/sqlite_waiting.h"

namespace colmap_graphmatch::sqlite {
namespace {

// Whether the disk of a file has no room for the -shm file that SQLite makes, even to read, in
// write-ahead mode.
bool DiskIsFull(const std::filesystem::path& path) {
  constexpr std::uintmax_t kShmBytes = 32768;
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(path, error);
  return !error && space.available < kShmBytes;
}

// What the operating system said last, if it explains why a file could not be used.
std::string DescribeSystemError(int error) {
  switch (error) {
    case EMFILE:
    case ENFILE:
      return std::string(std::strerror(error)) +
             ". Let the program open more files (ulimit -n), or use fewer threads with "
             "--SiftMatching.num_threads";
    default:
      return "";
  }
}

// SQLite does not keep the reason of a write that failed.
std::string DescribeSizeLimit() {
  struct rlimit limit = {};
  if (::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return "";
  return " Perhaps the file would be larger than the system allows (ulimit -f is " +
         std::to_string(limit.rlim_cur / 1024) +
         " KB): raise that limit and run the same command again to go on. Nothing half-written was "
         "kept.";
}

std::string Seconds(double seconds) {
  std::string text = std::to_string(seconds);
  text.resize(text.find('.') + 2);
  return text + " s";
}

}  // namespace

void Connection::Throw(const std::string& doing) const {
  const int code = db_ ? sqlite3_extended_errcode(db_.get()) : SQLITE_NOMEM;
  const std::string detail = db_ ? sqlite3_errmsg(db_.get()) : "out of memory";
  const std::string what = "Cannot " + doing + " in " + path_.string() + ": ";
  const std::string system_error = DescribeSystemError(db_ ? sqlite3_system_errno(db_.get()) : 0);
  const int kind = code & 0xFF;
  if (!system_error.empty() &&
      (kind == SQLITE_CANTOPEN || kind == SQLITE_IOERR || kind == SQLITE_FULL)) {
    throw DatabaseError(what + system_error + ".");
  }
  // Of that full disk SQLite only says "disk I/O error".
  const bool disk_is_full = kind == SQLITE_IOERR && DiskIsFull(path_);
  switch (disk_is_full ? SQLITE_FULL : kind) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      if (waiting_->IsRequested()) throw StoppedError();
      throw DatabaseLockedError(what + "another process kept it locked for " +
                                Seconds(waiting_->patience.seconds) + " (" +
                                DescribeLockHolders(lockable_path_) +
                                "). Close that program, or wait longer with "
                                "--GraphMatching.lock_timeout.");
    case SQLITE_NOTADB:
      throw DamagedFileError(path_.string() +
                             " is not a SQLite database. Give the database.db that "
                             "`colmap feature_extractor` wrote.");
    case SQLITE_INTERRUPT:
      if (waiting_->IsRequested()) throw StoppedError();
      throw DatabaseError(what +
                          "it does not come to an end. The file is damaged: `sqlite3 FILE "
                          ".recover` may save its contents.");
    case SQLITE_CORRUPT:
      throw DamagedFileError(
          what + detail + ". The file is damaged: `sqlite3 FILE .recover` may save its contents.");
    case SQLITE_FULL:
      throw DatabaseError(what +
                          "the disk is full. Nothing half-written was kept; free some space "
                          "and run the same command again to go on.");
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
      throw DatabaseError(what + detail +
                          ". SQLite needs to write to the file and to its directory: if they or "
                          "their disk are read-only, copy the database to a place that you can "
                          "write to.");
    case SQLITE_IOERR:
      throw DatabaseError(what + detail + "." + DescribeSizeLimit());
    default:
      throw DatabaseError(what + detail + ".");
  }
}

}  // namespace colmap_graphmatch::sqlite
