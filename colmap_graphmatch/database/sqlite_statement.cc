#include <sqlite3.h>

#include <algorithm>
#include <utility>

#include "colmap_graphmatch/database/sqlite.h"
#include "colmap_graphmatch/database/sqlite_waiting.h"

namespace colmap_graphmatch::sqlite {

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

double Statement::Double(int column) const {
  return sqlite3_column_double(statement_.get(), column);
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
