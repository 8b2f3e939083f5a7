#include "colmap_graphmatch/database/state_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <boost/crc.hpp>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/file_descriptor.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/database/lock_holder.h"

namespace colmap_graphmatch {
namespace {

// "GMst", in the place that SQLite has for telling what a database is (PRAGMA application_id).
constexpr std::int64_t kApplicationId = 0x474D7374;

// Of the layout of the tables and of the meaning of what is in them.
constexpr std::int64_t kFormatVersion = 2;

std::int64_t Checksum(const void* data, std::size_t size) {
  boost::crc_32_type crc;
  crc.process_bytes(data, size);
  return crc.checksum();
}

std::int64_t ReadNumber(sqlite::Connection& connection, const std::string& sql) {
  sqlite::Statement select(connection, sql);
  return select.Step() ? select.Int(0) : 0;
}

void SetVersion(sqlite::Connection& connection) {
  connection.Execute("PRAGMA user_version = " + std::to_string(kFormatVersion));
}

void CreateTables(sqlite::Connection& connection) {
  connection.Execute(
      "CREATE TABLE mixture(key TEXT NOT NULL, checksum INTEGER NOT NULL, "
      "data BLOB NOT NULL)");
  connection.Execute(
      "CREATE TABLE vectors(image_id INTEGER PRIMARY KEY NOT NULL, features INTEGER "
      "NOT NULL, checksum INTEGER NOT NULL, data BLOB NOT NULL)");
  connection.Execute("CREATE TABLE run(key TEXT NOT NULL, checksum INTEGER NOT NULL)");
  connection.Execute("CREATE TABLE seeds(pair_id INTEGER PRIMARY KEY NOT NULL)");
  connection.Execute("PRAGMA application_id = " + std::to_string(kApplicationId));
  SetVersion(connection);
}

// For a file that SQLite cannot read any more. No connection to it may be open in this process:
// that would lose its locks.
bool HeaderIsOurs(const std::filesystem::path& path) {
  // SQLite keeps the number big-endian at this place of the header.
  constexpr std::streamoff kOffset = 68;
  std::array<unsigned char, 4> bytes = {};
  std::ifstream file(path, std::ios::binary);
  file.seekg(kOffset);
  file.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  std::int64_t id = 0;
  for (const unsigned char byte : bytes) id = id * 256 + byte;
  return file && id == kApplicationId;
}

bool HasAllTables(sqlite::Connection& connection) {
  for (const char* table : {"mixture", "vectors", "run", "seeds"}) {
    if (connection.Columns(table).empty()) return false;
  }
  return true;
}

enum class Content { kEmpty, kIntact, kToBeMadeAnew, kSomethingElse };

Content Examine(sqlite::Connection& connection) {
  if (ReadNumber(connection, "PRAGMA application_id") != kApplicationId) {
    const bool is_empty = ReadNumber(connection, "SELECT count(*) FROM sqlite_master") == 0;
    return is_empty ? Content::kEmpty : Content::kSomethingElse;
  }
  const bool same_version = ReadNumber(connection, "PRAGMA user_version") == kFormatVersion;
  return same_version && HasAllTables(connection) ? Content::kIntact : Content::kToBeMadeAnew;
}

// Takes the lock, and makes the tables in an empty file.
Content LockAndExamine(sqlite::Connection& connection) {
  connection.Execute("PRAGMA synchronous = OFF");
  sqlite::Transaction transaction(connection, sqlite::Transaction::Kind::kExclusive);
  const Content content = Examine(connection);
  if (content == Content::kEmpty) CreateTables(connection);
  // A write that changes nothing: with it goes the journal that a killed run has left.
  if (content == Content::kIntact) SetVersion(connection);
  transaction.Commit();
  return content;
}

// Empties the file in place, under its lock: another run may be waiting for it.
void EmptyAndLock(sqlite::Connection& connection) {
  connection.ResetDatabase();
  LockAndExamine(connection);
}

// The rights that a state file has at most: those of the database.
mode_t RightsBeside(const struct stat& database) {
  return (database.st_mode & 0666U) | S_IRUSR | S_IWUSR;
}

// Makes an empty state file with the owner and the rights of the database, as SQLite does with its
// files, if there is nothing in its place. What cannot be done shows when it is opened.
void MakeEmptyFile(const std::filesystem::path& database_path, const std::filesystem::path& path) {
  struct stat database = {};
  if (::stat(database_path.c_str(), &database) != 0) return;
  const FileDescriptor made(
      ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, RightsBeside(database)));
  const bool is_given_away = made.Number() >= 0 && ::geteuid() == 0;
  if (is_given_away && ::fchown(made.Number(), database.st_uid, database.st_gid) != 0) errno = 0;
}

// Takes from a state file the rights that the database does not give. (Not by a descriptor: to
// close it would lose the lock.)
void TakeRights(const std::filesystem::path& database_path, const std::filesystem::path& path) {
  struct stat database = {};
  struct stat own = {};
  if (::stat(database_path.c_str(), &database) != 0 || ::lstat(path.c_str(), &own) != 0) return;
  const mode_t rights = RightsBeside(database);
  if (S_ISREG(own.st_mode) && (own.st_mode & 0777U & ~rights) != 0) {
    ::chmod(path.c_str(), own.st_mode & rights);
  }
}

}  // namespace

std::filesystem::path StateFile::PathFor(const std::filesystem::path& database_path) {
  std::error_code error;
  std::filesystem::path path = std::filesystem::canonical(database_path, error);
  if (error) path = database_path;
  path += ".graphmatch";
  return path;
}

StateFile::StateFile(const std::filesystem::path& database_path,
                     const sqlite::LockPatience& patience)
    : path_(PathFor(database_path)),
      connection_((MakeEmptyFile(database_path, path_), Open(path_, patience))) {
  TakeRights(database_path, path_);
}

sqlite::Connection StateFile::Open(const std::filesystem::path& path,
                                   const sqlite::LockPatience& patience) {
  const auto something_else = [&path] {
    return DatabaseError(path.string() +
                         " is in the way: it is not a file of this program, which keeps there what "
                         "speeds up the next run. Move it, or delete it.");
  };
  const auto open = [&] {
    std::error_code ignored;
    const bool leads_nowhere =
        std::filesystem::is_symlink(path, ignored) && !std::filesystem::exists(path, ignored);
    if (leads_nowhere || !WhyNotRegular(path).empty()) throw something_else();
    sqlite::Connection connection(path, sqlite::Access::kCreate, patience);
    // The lock stays when a transaction ends. What is lost in a crash is only worth the time to
    // compute it.
    connection.Execute("PRAGMA locking_mode = EXCLUSIVE");
    return connection;
  };
  try {
    try {
      sqlite::Connection connection = open();
      const Content content = LockAndExamine(connection);
      if (content == Content::kSomethingElse) throw something_else();
      if (content == Content::kToBeMadeAnew) EmptyAndLock(connection);
      return connection;
    } catch (const sqlite::DamagedFileError&) {
      if (!HeaderIsOurs(path)) throw something_else();
    }
    sqlite::Connection connection = open();
    EmptyAndLock(connection);
    return connection;
  } catch (const DatabaseLockedError&) {
    throw DatabaseLockedError(
        "Another graphmatch_matcher works on this database: it holds " + path.string() + " (" +
        DescribeLockHolders(path) +
        "). Let it finish, or wait longer with --GraphMatching.lock_timeout.");
  }
}

void StateFile::MakeAnew() { EmptyAndLock(connection_); }

std::optional<sqlite::Blob> StateFile::ReadMixture(const std::string& key) {
  sqlite::Statement select(connection_, "SELECT data, checksum FROM mixture WHERE key = ?1");
  if (!select.Bind(1, key).Step()) return std::nullopt;
  sqlite::Blob mixture = select.CopyBlob(0);
  if (Checksum(mixture.data(), mixture.size()) != select.Int(1)) return std::nullopt;
  return mixture;
}

void StateFile::WriteMixture(const std::string& key, const sqlite::Blob& mixture) {
  sqlite::Transaction transaction(connection_);
  connection_.Execute("DELETE FROM mixture");
  connection_.Execute("DELETE FROM vectors");
  sqlite::Statement insert(connection_, "INSERT INTO mixture VALUES(?1, ?2, ?3)");
  insert.Bind(1, key).Bind(2, Checksum(mixture.data(), mixture.size())).Bind(3, mixture).Run();
  transaction.Commit();
}

void StateFile::DropVectorsExcept(const std::vector<ImageFingerprint>& images) {
  std::vector<std::int64_t> others;
  {
    sqlite::Statement select(connection_, "SELECT image_id FROM vectors ORDER BY image_id");
    auto image = images.begin();
    while (select.Step()) {
      if (!others.empty() && select.Int(0) <= others.back()) break;
      while (image != images.end() && std::int64_t{image->id} < select.Int(0)) ++image;
      if (image == images.end() || std::int64_t{image->id} != select.Int(0)) {
        others.push_back(select.Int(0));
      }
    }
  }
  if (others.empty()) return;
  sqlite::Transaction transaction(connection_);
  sqlite::Statement drop(connection_, "DELETE FROM vectors WHERE image_id = ?1");
  for (const std::int64_t id : others) drop.Bind(1, id).Run();
  transaction.Commit();
}

std::vector<ImageId> StateFile::FindChanged(const std::vector<ImageFingerprint>& images) {
  sqlite::Statement select(connection_,
                           "SELECT 1 FROM vectors WHERE image_id = ?1 AND features <> ?2");
  std::vector<ImageId> changed;
  for (const ImageFingerprint& image : images) {
    if (select.Bind(1, std::int64_t{image.id}).Bind(2, image.features).Step()) {
      changed.push_back(image.id);
    }
    select.Reset();
  }
  return changed;
}

std::size_t StateFile::CountVectors(const std::vector<ImageFingerprint>& images) {
  sqlite::Statement select(connection_,
                           "SELECT 1 FROM vectors WHERE image_id = ?1 AND features = ?2");
  std::size_t count = 0;
  for (const ImageFingerprint& image : images) {
    if (select.Bind(1, std::int64_t{image.id}).Bind(2, image.features).Step()) ++count;
    select.Reset();
  }
  return count;
}

std::vector<bool> StateFile::ReadVectors(const std::vector<ImageFingerprint>& images,
                                         const TakeVector& take) {
  std::vector<bool> found(images.size());
  sqlite::Statement select(
      connection_, "SELECT data, checksum FROM vectors WHERE image_id = ?1 AND features = ?2");
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (select.Bind(1, std::int64_t{images[i].id}).Bind(2, images[i].features).Step()) {
      const std::uint8_t* data = select.Data(0);
      const std::size_t size = select.Size(0);
      found[i] = Checksum(data, size) == select.Int(1) && take(i, data, size);
    }
    select.Reset();
  }
  return found;
}

void StateFile::WriteVectors(const std::vector<ImageFingerprint>& images,
                             const std::function<sqlite::Blob(std::size_t i)>& vector_of) {
  sqlite::Transaction transaction(connection_);
  sqlite::Statement insert(connection_, "INSERT OR REPLACE INTO vectors VALUES(?1, ?2, ?3, ?4)");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const sqlite::Blob data = vector_of(i);
    insert.Bind(1, std::int64_t{images[i].id})
        .Bind(2, images[i].features)
        .Bind(3, Checksum(data.data(), data.size()))
        .Bind(4, data)
        .Run();
  }
  transaction.Commit();
}

std::optional<std::vector<ImagePair>> StateFile::ReadSeeds(const std::string& key) {
  sqlite::Statement run(connection_, "SELECT checksum FROM run WHERE key = ?1");
  if (!run.Bind(1, key).Step()) return std::nullopt;
  sqlite::Statement select(connection_, "SELECT pair_id FROM seeds ORDER BY pair_id");
  std::vector<std::int64_t> keys;
  while (select.Step()) {
    // What does not ascend may have no end.
    if (!keys.empty() && select.Int(0) <= keys.back()) return std::nullopt;
    keys.push_back(select.Int(0));
  }
  if (Checksum(keys.data(), keys.size() * sizeof(keys[0])) != run.Int(0)) return std::nullopt;
  std::vector<ImagePair> seeds;
  seeds.reserve(keys.size());
  for (const std::int64_t pair_id : keys) {
    seeds.push_back(DecodePair(static_cast<PairId>(pair_id)));
  }
  return seeds;
}

void StateFile::WriteSeeds(const std::string& key, const std::vector<ImagePair>& seeds) {
  std::vector<std::int64_t> keys;
  keys.reserve(seeds.size());
  for (const ImagePair& pair : seeds) keys.push_back(static_cast<std::int64_t>(EncodePair(pair)));
  sqlite::Transaction transaction(connection_);
  connection_.Execute("DELETE FROM run");
  connection_.Execute("DELETE FROM seeds");
  sqlite::Statement run(connection_, "INSERT INTO run VALUES(?1, ?2)");
  run.Bind(1, key).Bind(2, Checksum(keys.data(), keys.size() * sizeof(keys[0]))).Run();
  sqlite::Statement insert(connection_, "INSERT INTO seeds VALUES(?1)");
  for (const std::int64_t pair_id : keys) insert.Bind(1, pair_id).Run();
  transaction.Commit();
}

}  // namespace colmap_graphmatch
