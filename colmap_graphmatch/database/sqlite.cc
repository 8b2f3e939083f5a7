#include "colmap_graphmatch/database/sqlite.h"

#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/base/stopwatch.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/database/lock_holder.h"

namespace colmap_graphmatch::sqlite {
namespace {

// Pages that refer to each other in a damaged file can keep SQLite busy for ever, so its virtual
// machine gets no more instructions than take a second or two, and what it takes to go through the
// file once: fewer to prepare a statement, for then it reads the schema and parses every line of
// it; enough in a step to fill a shard of 100,000 pairs.
constexpr int kInstructionsPerProgressCall = 100000;
constexpr int kProgressCallsToPrepare = 5;
constexpr int kProgressCallsToRun = 300;

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

std::string Seconds(double seconds) {
  std::string text = std::to_string(seconds);
  text.resize(text.find('.') + 2);
  return text + " s";
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

// In place of SQLite's own waiting, which nothing can interrupt.
struct Connection::Waiting {
  explicit Waiting(const LockPatience& with) : patience(with) {}

  // How long a write that is to be finished waits after the stop request.
  static constexpr double kSecondsToFinish = 2;

  LockPatience patience;
  bool finishes_writes = false;
  Stopwatch since;  // The first try.

  Stopwatch since_request;
  bool is_requested = false;

  bool IsRequested() const { return patience.stop != nullptr && patience.stop->Requested(); }

  bool Stops() {
    if (!IsRequested()) return false;
    if (!std::exchange(is_requested, true)) since_request = Stopwatch();
    return !finishes_writes || patience.stop->Abandon() ||
           since_request.Seconds() > kSecondsToFinish;
  }

  // SQLite's handler: whether to try again.
  static int Wait(void* self, int num_tries) {
    auto* waiting = static_cast<Waiting*>(self);
    if (num_tries == 0) waiting->since = Stopwatch();
    const double left = waiting->patience.seconds - waiting->since.Seconds();
    if (left <= 0 || waiting->Stops()) return 0;
    constexpr double kLongestPause = 0.05;
    const double pause = std::min({0.001 * (num_tries + 1), kLongestPause, left});
    std::this_thread::sleep_for(std::chrono::duration<double>(pause));
    return 1;
  }
};

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

Statement::Statement(Connection& connection, const std::string& sql)
    : connection_(&connection), statement_(nullptr, &sqlite3_finalize) {
  *connection.progress_calls_left_ = kProgressCallsToPrepare;
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(connection.db_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
    connection.Throw("read the tables");
  }
  statement_.reset(statement);
}

Statement& Statement::CheckBind(int result) {
  if (result != SQLITE_OK) connection_->Throw("bind a value");
  return *this;
}

Statement& Statement::Bind(int parameter, std::int64_t value) {
  return CheckBind(sqlite3_bind_int64(statement_.get(), parameter, value));
}

Statement& Statement::Bind(int parameter, std::string_view text) {
  return CheckBind(sqlite3_bind_text64(statement_.get(), parameter, text.data(), text.size(),
                                       SQLITE_TRANSIENT, SQLITE_UTF8));
}

Statement& Statement::Bind(int parameter, const Blob& blob) {
  return BindBytes(parameter, blob.data(), blob.size());
}

Statement& Statement::BindBytes(int parameter, const void* data, std::size_t size) {
  if (size == 0) return BindNull(parameter);
  return CheckBind(sqlite3_bind_blob64(statement_.get(), parameter, data, size, SQLITE_STATIC));
}

Statement& Statement::BindNull(int parameter) {
  return CheckBind(sqlite3_bind_null(statement_.get(), parameter));
}

bool Statement::Step() {
  *connection_->progress_calls_left_ = connection_->progress_calls_to_run_;
  switch (sqlite3_step(statement_.get())) {
    case SQLITE_ROW:
      return true;
    case SQLITE_DONE:
      return false;
    default:
      connection_->Throw(sqlite3_stmt_readonly(statement_.get()) != 0 ? "read" : "write");
  }
}

void Statement::Reset() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

void Statement::Run() {
  Step();
  Reset();
}

bool Statement::IsNull(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

std::int64_t Statement::Int(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string Statement::Text(int column) const {
  const unsigned char* text = sqlite3_column_text(statement_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return text == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(text), size);
}

const std::uint8_t* Statement::Data(int column) const {
  const void* data = sqlite3_column_blob(statement_.get(), column);
  if (data == nullptr && Size(column) > 0) connection_->Throw("read a blob");
  return static_cast<const std::uint8_t*>(data);
}

std::size_t Statement::Size(int column) const {
  return static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
}

Blob Statement::CopyBlob(int column) const {
  const std::uint8_t* data = Data(column);
  return data == nullptr ? Blob() : Blob(data, data + Size(column));
}

BlobPrefixReader::BlobPrefixReader(Connection& connection, const std::string& table,
                                   const std::string& column)
    : connection_(&connection), table_(table), column_(column) {}

BlobPrefixReader::~BlobPrefixReader() { sqlite3_blob_close(blob_); }

Blob BlobPrefixReader::Read(std::int64_t row, std::size_t num_bytes) {
  *connection_->progress_calls_left_ = connection_->progress_calls_to_run_;
  const int result = blob_ == nullptr
                         ? sqlite3_blob_open(connection_->db_.get(), "main", table_.c_str(),
                                             column_.c_str(), row, 0, &blob_)
                         : sqlite3_blob_reopen(blob_, row);
  if (result != SQLITE_OK) connection_->Throw("read a blob of the table " + table_);
  Blob blob(std::min(num_bytes, static_cast<std::size_t>(sqlite3_blob_bytes(blob_))));
  if (sqlite3_blob_read(blob_, blob.data(), static_cast<int>(blob.size()), 0) != SQLITE_OK) {
    connection_->Throw("read a blob of the table " + table_);
  }
  return blob;
}

Transaction::Transaction(Connection& connection, Kind kind) : connection_(&connection) {
  connection.Execute(kind == Kind::kExclusive ? "BEGIN EXCLUSIVE" : "BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  if (committed_) return;
  try {
    connection_->Execute("ROLLBACK");
  } catch (const Error&) {
    // SQLite has rolled back by itself (a full disk, an I/O error): what was to be done is done.
  }
}

void Transaction::Commit() {
  connection_->Execute("COMMIT");
  committed_ = true;
}

}  // namespace colmap_graphmatch::sqlite
