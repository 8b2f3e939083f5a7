#include "colmap_graphmatch/database/sqlite.h"

#include <sqlite3.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <mutex>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/sqlite_waiting.h"

namespace colmap_graphmatch::sqlite {
namespace {

// A row takes some ten bytes, and some ten instructions to be looked at.
constexpr int kInstructionsPerByte = 10;

// To go through a file once. What counts is what it takes of the disk: its size can be made up.
int ProgressCallsToScan(const std::filesystem::path& path) {
  struct stat status = {};
  if (::stat(path.c_str(), &status) != 0) return 0;
  constexpr std::int64_t kBytesPerBlock = 512;  // POSIX leaves it open; Linux does not.
  const std::int64_t bytes =
      std::min<std::int64_t>(status.st_size, status.st_blocks * kBytesPerBlock);
  const std::int64_t calls = bytes / (kInstructionsPerProgressCall / kInstructionsPerByte);
  return static_cast<int>(std::min<std::int64_t>(calls, std::numeric_limits<int>::max() / 4));
}

int CountProgressCall(void* num_calls_left) { return --*static_cast<int*>(num_calls_left) < 0; }

// Nothing in a file is longer than the file, and nothing that is added to it longer than this.
constexpr std::int64_t kMaxAddedLength = std::int64_t{64} << 20;

void LimitLength(sqlite3* db, const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  constexpr std::uintmax_t kMost = 1'000'000'000;  // SQLite's own default.
  const auto length = static_cast<int>(std::min((error ? 0 : size) + kMaxAddedLength, kMost));
  const int before = sqlite3_limit(db, SQLITE_LIMIT_LENGTH, -1);
  if (length != before) sqlite3_limit(db, SQLITE_LIMIT_LENGTH, length);
}

// SQLite's advice for files from strangers (https://www.sqlite.org/security.html). COLMAP's
// databases have no views, triggers or virtual tables in any version; users' own do no harm as long
// as they are not run.
void Harden(sqlite3* db) {
  sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_drop_modules(db, nullptr);
  sqlite3_limit(db, SQLITE_LIMIT_ATTACHED, 1);
  sqlite3_limit(db, SQLITE_LIMIT_WORKER_THREADS, 0);
}

// A file: URI, in which '?', '#' and '%' of the path would otherwise have a meaning.
std::string ReadOnlyUri(const std::filesystem::path& path) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte <= ' ' || byte >= 0x7F || c == '%' || c == '?' || c == '#') {
      uri += {'%', kHex[byte >> 4], kHex[byte & 15]};
    } else {
      uri += c;
    }
  }
  return uri + "?mode=ro";
}

void CheckFiles(const std::filesystem::path& path) {
  std::vector<std::filesystem::path> files = FilesBeside(path);
  files.push_back(path);
  for (const std::filesystem::path& file : files) {
    const std::string reason = WhyNotRegular(file);
    if (reason.empty()) continue;
    throw DatabaseError("Cannot open " + path.string() + " as a database: " +
                        (file == path ? reason : file.string() + ": " + reason) + ".");
  }
}

}  // namespace

std::vector<std::filesystem::path> FilesBeside(const std::filesystem::path& database_path) {
  // SQLite follows links and has its files beside where they lead.
  std::error_code error;
  std::filesystem::path path = std::filesystem::canonical(database_path, error);
  if (error) path = database_path;
  std::vector<std::filesystem::path> files;
  for (const char* suffix : {"-wal", "-shm", "-journal"})
    files.emplace_back(path.string() + suffix);
  return files;
}

namespace {

// While it lives, a stop request ends what SQLite does: what takes long in one step, and asks
// nobody.
class InterruptedByStop {
 public:
  InterruptedByStop(sqlite3* db, const StopRequest* stop)
      : thread_(stop == nullptr ? 0 : 1, [this, db, stop] { Watch(db, *stop); }) {}
  ~InterruptedByStop() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_over_ = true;
    }
    over_.notify_one();
    thread_.Join();
  }
  InterruptedByStop(const InterruptedByStop&) = delete;
  InterruptedByStop& operator=(const InterruptedByStop&) = delete;

 private:
  void Watch(sqlite3* db, const StopRequest& stop) {
    constexpr std::chrono::milliseconds kInterval(50);
    std::unique_lock<std::mutex> lock(mutex_);
    while (!over_.wait_for(lock, kInterval, [this] { return is_over_; })) {
      if (stop.Requested()) sqlite3_interrupt(db);
    }
  }

  std::mutex mutex_;
  std::condition_variable over_;
  bool is_over_ = false;
  ThreadGroup thread_;  // The last: it uses the others.
};

}  // namespace

Connection::~Connection() = default;
Connection::Connection(Connection&&) noexcept = default;

Connection::Connection(const std::filesystem::path& path, Access access,
                       const LockPatience& patience)
    : path_(path),
      lockable_path_(path),
      waiting_(std::make_unique<Waiting>(patience)),
      progress_calls_left_(std::make_unique<int>(kProgressCallsToPrepare)),
      progress_calls_to_run_(kProgressCallsToRun + ProgressCallsToScan(path)),
      db_(nullptr, &sqlite3_close) {
  const int mode = access == Access::kRead        ? SQLITE_OPEN_READONLY
                   : access == Access::kReadWrite ? SQLITE_OPEN_READWRITE
                                                  : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  CheckFiles(path);
  sqlite3* db = nullptr;
  // Absolute: a relative path could begin like a URI.
  const int result = sqlite3_open_v2(std::filesystem::absolute(path).c_str(), &db,
                                     mode | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  db_.reset(db);
  if (result != SQLITE_OK) Throw("open the database");
  // SQLite falls back to reading a file that it may not write, without a word.
  if (access != Access::kRead && sqlite3_db_readonly(db, "main") == 1) {
    throw DatabaseError(
        path.string() +
        " is read-only. Give yourself the right to write to it, or copy it to a place that "
        "you can write to.");
  }
  sqlite3_extended_result_codes(db, 1);
  sqlite3_busy_handler(db, &Waiting::Wait, waiting_.get());
  Harden(db);
  LimitLength(db, path);
  sqlite3_progress_handler(db, kInstructionsPerProgressCall, &CountProgressCall,
                           progress_calls_left_.get());
  Execute("PRAGMA cell_size_check = ON; PRAGMA ignore_check_constraints = ON");
}

void Connection::Execute(const std::string& sql) {
  *progress_calls_left_ = progress_calls_to_run_;
  if (sqlite3_exec(db_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    Throw("write");
  }
}

void Connection::ResetDatabase() {
  sqlite3_db_config(db_.get(), SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
  sqlite3_db_config(db_.get(), SQLITE_DBCONFIG_RESET_DATABASE, 1, nullptr);
  *progress_calls_left_ = progress_calls_to_run_;
  const int result = sqlite3_exec(db_.get(), "VACUUM", nullptr, nullptr, nullptr);
  sqlite3_db_config(db_.get(), SQLITE_DBCONFIG_RESET_DATABASE, 0, nullptr);
  sqlite3_db_config(db_.get(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  if (result != SQLITE_OK) Throw("empty the database");
}

void Connection::AttachReadOnly(const std::filesystem::path& path, const std::string& schema) {
  Statement attach(*this, "ATTACH ?1 AS " + schema);
  attach.Bind(1, ReadOnlyUri(path)).Run();
  progress_calls_to_run_ += ProgressCallsToScan(path);
  LimitLength(db_.get(), path);
  lockable_path_ = path;
}

void Connection::FinishWrites() { waiting_->finishes_writes = true; }

bool Connection::HasMoved() {
  int has_moved = 0;
  sqlite3_file_control(db_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &has_moved);
  return has_moved != 0;
}

std::int64_t Connection::DataVersion() {
  Statement version(*this, "PRAGMA data_version");
  version.Step();
  return version.Int(0);
}

void Connection::CheckPages(const std::string& table) {
  Statement check(*this, "PRAGMA main.quick_check('" + table + "')");
  const InterruptedByStop interruptible(db_.get(), waiting_->patience.stop);
  while (check.Step()) {
    // Other lines speak of values in rows, which no write makes worse.
    const std::string line = check.Text(0);
    if (line.rfind("*** in database", 0) != 0) continue;
    const std::string problem = line.substr(std::min(line.find('\n'), line.size() - 1) + 1);
    throw DamagedFileError(path_.string() + " is damaged where " + table + " is (" +
                           problem.substr(0, problem.find('\n')) +
                           "), and to write to it could destroy more. Nothing was written: "
                           "`sqlite3 FILE .recover` may save its contents.");
  }
}

std::vector<std::string> Connection::Columns(const std::string& table, const std::string& schema) {
  Statement info(*this, "SELECT name FROM pragma_table_info(?1, ?2) ORDER BY cid");
  info.Bind(1, table).Bind(2, schema);
  std::vector<std::string> columns;
  while (info.Step()) columns.push_back(info.Text(0));
  return columns;
}

}  // namespace colmap_graphmatch::sqlite
