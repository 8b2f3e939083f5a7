#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/stop_request.h"

struct sqlite3;
struct sqlite3_blob;
struct sqlite3_stmt;

// The little of SQLite that COLMAP databases need, with errors as exceptions: DatabaseLockedError
// when another process held a lock for longer than the connection waits, DatabaseError otherwise.
//
// Databases come from strangers. Nothing that a file brings along is run: no views, no triggers, no
// virtual tables, no CHECK constraints; and a step that does not come to an end, which takes a
// damaged file, is an error.

namespace colmap_graphmatch::sqlite {

using Blob = std::vector<std::uint8_t>;

// kCreate: like kReadWrite, and a file that is not there is made.
enum class Access { kRead, kReadWrite, kCreate };

// How long a connection waits for locks of other processes, and what ends the wait early.
struct LockPatience {
  // NOLINTNEXTLINE(google-explicit-constructor): a number of seconds is one.
  LockPatience(double for_seconds, const StopRequest* until = nullptr)
      : seconds(for_seconds), stop(until) {}

  double seconds;
  const StopRequest* stop;  // If it is raised meanwhile: StoppedError.
};

// The files that SQLite may have beside a database.
std::vector<std::filesystem::path> FilesBeside(const std::filesystem::path& database_path);

// The file is no SQLite database, or a damaged one.
class DamagedFileError : public DatabaseError {
 public:
  using DatabaseError::DatabaseError;
};

class Connection {
 public:
  // Opens a file. patience: of every later call.
  Connection(const std::filesystem::path& path, Access access, const LockPatience& patience);
  ~Connection();
  Connection(Connection&&) noexcept;
  Connection& operator=(Connection&&) = delete;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  const std::filesystem::path& Path() const { return path_; }

  // Runs statements that return no rows.
  void Execute(const std::string& sql);

  // Empties the database, whatever state it is in.
  void ResetDatabase();

  // Makes the tables of another database file readable (and only that) under the schema name. From
  // then on it is taken to be the one that other programs may have locked.
  void AttachReadOnly(const std::filesystem::path& path, const std::string& schema);

  // From now on a wait for a lock goes on for some seconds after the first stop request, for what
  // was computed is lost otherwise; the second one ends it.
  void FinishWrites();

  // Whether there is another file at the path by now, or none.
  bool HasMoved();

  // Changes whenever another connection has changed the database.
  std::int64_t DataVersion();

  // Goes through all pages of a table and throws DamagedFileError if they do not fit together:
  // rows that are written to such a table may take the place of others. Reads the whole table.
  void CheckPages(const std::string& table);

  // The columns of a table in their order; empty if there is no such table.
  std::vector<std::string> Columns(const std::string& table, const std::string& schema = "main");

  [[noreturn]] void Throw(const std::string& doing) const;

 private:
  friend class BlobPrefixReader;
  friend class Statement;

  std::filesystem::path path_;
  std::filesystem::path lockable_path_;  // The file that other programs may have locked.
  struct Waiting;
  std::unique_ptr<Waiting> waiting_;          // For locks. SQLite has its address.
  std::unique_ptr<int> progress_calls_left_;  // Of the call under way; SQLite has its address.
  int progress_calls_to_run_;
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> db_;
};

// A prepared statement. Parameters are numbered from 1, columns from 0, as in SQLite.
class Statement {
 public:
  Statement(Connection& connection, const std::string& sql);

  Statement& Bind(int parameter, std::int64_t value);
  Statement& Bind(int parameter, std::string_view text);
  // The blob is not copied: it must outlive the next Step. An empty blob is bound as NULL, which is
  // what COLMAP stores for a matrix without rows.
  Statement& Bind(int parameter, const Blob& blob);
  Statement& BindBytes(int parameter, const void* data, std::size_t size);
  Statement& BindNull(int parameter);

  // True if there is a row.
  bool Step();
  // Makes the statement ready for new parameters.
  void Reset();
  // Step and Reset of a statement that returns no rows.
  void Run();

  bool IsNull(int column) const;
  std::int64_t Int(int column) const;
  double Double(int column) const;
  std::string Text(int column) const;
  // The bytes of a blob; valid until the next Step. Throws if SQLite cannot read them.
  const std::uint8_t* Data(int column) const;
  std::size_t Size(int column) const;
  Blob CopyBlob(int column) const;

 private:
  Statement& CheckBind(int result);

  Connection* connection_;
  std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement_;
};

// The beginning of the blobs of a column, without reading the rest of them.
class BlobPrefixReader {
 public:
  // The table's rows must be numbered by an INTEGER PRIMARY KEY.
  BlobPrefixReader(Connection& connection, const std::string& table, const std::string& column);
  ~BlobPrefixReader();
  BlobPrefixReader(const BlobPrefixReader&) = delete;
  BlobPrefixReader& operator=(const BlobPrefixReader&) = delete;

  // At most num_bytes of the blob of a row. Throws if there is no such row, or no blob in it.
  Blob Read(std::int64_t row, std::size_t num_bytes);

 private:
  Connection* connection_;
  std::string table_;
  std::string column_;
  sqlite3_blob* blob_ = nullptr;
};

// Rolls back when it goes out of scope, unless Commit was called.
class Transaction {
 public:
  // kImmediate: takes the write lock now, so that a competing writer is met here. kExclusive:
  // nobody else may even read.
  enum class Kind { kImmediate, kExclusive };
  explicit Transaction(Connection& connection, Kind kind = Kind::kImmediate);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  void Commit();

 private:
  Connection* connection_;
  bool committed_ = false;
};

}  // namespace colmap_graphmatch::sqlite
