// Databases that are damaged, or made to do harm, through the whole program, with the test double
// in COLMAP's place. Whatever is in the file: the run returns, or throws an error of base/errors.h,
// within seconds and without much more memory than the file is large. Every run is a process of its
// own, so that a crash, a hang and the memory belong to one mutation, which its number brings back.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/colmap_graphmatch.h"
#include "tests/support/synthetic_database.h"

#if defined(__SANITIZE_THREAD__)
#define GRAPHMATCH_TSAN 1
#elif defined(__SANITIZE_ADDRESS__)
#define GRAPHMATCH_ASAN 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define GRAPHMATCH_TSAN 1
#elif __has_feature(address_sanitizer)
#define GRAPHMATCH_ASAN 1
#endif
#endif

#ifdef GRAPHMATCH_ASAN
// A process that asks for much more than the file holds ends with a report.
extern "C" const char* __asan_default_options();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __asan_default_options() {  // NOLINT(bugprone-reserved-identifier)
  return "max_allocation_size_mb=256:hard_rss_limit_mb=1024";
}
#endif

namespace colmap_graphmatch {
namespace {

// A sanitizer makes a run some three times as slow.
#if defined(GRAPHMATCH_ASAN) || defined(GRAPHMATCH_TSAN)
constexpr unsigned kMaxSeconds = 30;
constexpr bool kMeasuresMemory = false;
#else
constexpr unsigned kMaxSeconds = 10;
constexpr bool kMeasuresMemory = true;
#endif

// On top of what a run on the undamaged file takes, and in times of the file's size: the file once
// in SQLite's cache, once copied, once more on the way; and blocks of the allocator.
constexpr long kMaxExtraKilobytes = 24 << 10;
constexpr long kMaxTimesFile = 4;

struct Outcome {
  enum class Kind { kReturned, kError, kOtherException, kSignal, kExit };
  Kind kind = Kind::kReturned;
  int number = 0;  // Of the signal, or the exit code.
  std::string message;
  long max_kilobytes = 0;

  std::string Describe() const {
    switch (kind) {
      case Kind::kReturned:
        return "returned";
      case Kind::kError:
        return "threw an error: " + message;
      case Kind::kOtherException:
        return "threw what is no error of base/errors.h: " + message;
      case Kind::kSignal:
        return number == SIGALRM ? "did not end within " + std::to_string(kMaxSeconds) + " s"
                                 : "ended with signal " + std::to_string(number);
      case Kind::kExit:
        break;
    }
    return "ended with exit code " + std::to_string(number) + " (a sanitizer's report?)";
  }
};

// Not 1 or 66, which sanitizers use.
constexpr int kReturnedCode = 90;
constexpr int kErrorCode = 91;
constexpr int kOtherCode = 92;

Outcome RunInChild(const std::function<void()>& function) {
  std::array<int, 2> pipe = {};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  std::cout << std::flush;
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::alarm(kMaxSeconds);
    int code = kReturnedCode;
    std::string message;
    try {
      function();
    } catch (const Error& error) {
      code = kErrorCode;
      message = error.what();
    } catch (const std::exception& error) {
      code = kOtherCode;
      message = error.what();
    } catch (...) {
      code = kOtherCode;
      message = "no exception of the standard library";
    }
    message.resize(std::min<std::size_t>(message.size(), 4000));  // Fits into the pipe.
    if (::write(pipe[1], message.data(), message.size()) < 0) code = kOtherCode;
    ::_exit(code);
  }
  ::close(pipe[1]);
  Outcome outcome;
  std::array<char, 4096> buffer = {};
  for (ssize_t size = 0; (size = ::read(pipe[0], buffer.data(), buffer.size())) > 0;) {
    outcome.message.append(buffer.data(), static_cast<std::size_t>(size));
  }
  ::close(pipe[0]);
  int status = 0;
  struct rusage usage = {};
  ::wait4(child, &status, 0, &usage);
  outcome.max_kilobytes = usage.ru_maxrss;
  if (WIFSIGNALED(status)) {
    outcome.kind = Outcome::Kind::kSignal;
    outcome.number = WTERMSIG(status);
  } else {
    outcome.number = WEXITSTATUS(status);
    outcome.kind = outcome.number == kReturnedCode ? Outcome::Kind::kReturned
                   : outcome.number == kErrorCode  ? Outcome::Kind::kError
                   : outcome.number == kOtherCode  ? Outcome::Kind::kOtherException
                                                   : Outcome::Kind::kExit;
  }
  return outcome;
}

// SQLite as it is: what makes the mutations must be able to do what the program refuses.
class RawDatabase {
 public:
  explicit RawDatabase(const std::filesystem::path& path) {
    if (sqlite3_open(path.c_str(), &db_) != SQLITE_OK) throw std::runtime_error("cannot open");
    sqlite3_busy_timeout(db_, 5000);
  }
  ~RawDatabase() { sqlite3_close(db_); }
  RawDatabase(const RawDatabase&) = delete;
  RawDatabase& operator=(const RawDatabase&) = delete;

  void Execute(const std::string& sql) {
    char* message = nullptr;
    if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, &message) == SQLITE_OK) return;
    const std::string text = message == nullptr ? "" : message;
    sqlite3_free(message);
    throw std::runtime_error("the mutation \"" + sql + "\" failed: " + text);
  }

  // The texts of the first column.
  std::vector<std::string> Query(const std::string& sql) {
    std::vector<std::string> values;
    const auto add = [](void* list, int, char** row, char**) {
      static_cast<std::vector<std::string>*>(list)->emplace_back(row[0] == nullptr ? "" : row[0]);
      return 0;
    };
    sqlite3_exec(db_, sql.c_str(), add, &values, nullptr);
    return values;
  }

  // Runs a statement with one parameter, a blob.
  void ExecuteWith(const std::string& sql, const sqlite::Blob& blob) {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(db_, sql.c_str(), -1, &statement, nullptr);
    sqlite3_bind_blob64(statement, 1, blob.data(), blob.size(), SQLITE_STATIC);
    const int result = sqlite3_step(statement);
    sqlite3_finalize(statement);
    if (result != SQLITE_DONE) throw std::runtime_error("the mutation \"" + sql + "\" failed");
  }

  // What COLMAP's tables do not allow becomes possible: takes the words out of their definitions.
  void DropConstraints() {
    Execute(
        "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = replace(sql, 'NOT NULL', '') "
        "WHERE type = 'table'; PRAGMA writable_schema = RESET;"
        "PRAGMA ignore_check_constraints = ON");
  }

 private:
  sqlite3* db_ = nullptr;
};

constexpr std::array<Schema, 3> kSchemas = {Schema::kColmap38, Schema::kColmap310,
                                            Schema::kColmap42};
constexpr std::array<const char*, 3> kSchemaNames = {"38", "310", "42"};
constexpr int kNumFeatures = 40;

std::string Key(ImageId a, ImageId b) { return std::to_string(EncodePair(ImagePair(a, b))); }

// Six images of two places and one without features; matches that await verification, tested pairs,
// enough of them for a tree of several levels; free pages.
void WriteBase(const std::filesystem::path& path, Schema schema, int page_size) {
  std::vector<SyntheticImage> images = MakePlaces(2, 3, kNumFeatures, 1);
  images.push_back({"no features.jpg", {}, {}});
  WriteSyntheticDatabase(path, schema, images);
  RawDatabase database(path);
  database.Execute("PRAGMA journal_mode = DELETE; PRAGMA page_size = " + std::to_string(page_size) +
                   "; VACUUM");
  const std::string given = ", 20, 2, ?1)";
  sqlite::Blob matches;
  for (std::uint8_t i = 0; i < 20; ++i) {
    matches.insert(matches.end(), {i, 0, 0, 0, i, 0, 0, 0});
  }
  database.ExecuteWith("INSERT INTO matches VALUES(" + Key(1, 2) + given, matches);
  database.ExecuteWith("INSERT INTO matches VALUES(" + Key(4, 6) + given, matches);
  database.ExecuteWith("INSERT INTO matches VALUES(" + Key(2, 3) + given, matches);
  database.ExecuteWith(
      "INSERT INTO two_view_geometries(pair_id, rows, cols, data, config) VALUES(" + Key(2, 3) +
          ", 20, 2, ?1, 3)",
      matches);
  database.Execute(
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 400) INSERT INTO "
      "two_view_geometries(pair_id, rows, cols, config) SELECT 2147483647 * (100 + i) + 1000 + i, "
      "i % 30, 2, i % 9 FROM n");
  database.Execute(
      "CREATE TABLE gone(data BLOB); WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM "
      "n "
      "WHERE i < 20) INSERT INTO gone SELECT zeroblob(2000) FROM n; DROP TABLE gone;"
      "PRAGMA journal_mode = WAL");
}

std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void WriteFile(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string BigEndian(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16),
          static_cast<char>(value >> 8), static_cast<char>(value)};
}

class Mutation : public ::testing::Test {
 protected:
  // Makes a good database; the mutation then changes it.
  void Begin(std::size_t schema, int page_size = 4096) {
    schema_ = schema;
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
      std::filesystem::remove(path_.string() + suffix);
    }
    const std::filesystem::path base =
        directory_.Path() / (std::to_string(schema) + "-" + std::to_string(page_size));
    if (!std::filesystem::exists(base)) WriteBase(base, kSchemas[schema], page_size);
    std::filesystem::copy_file(base, path_);
  }

  // What the program makes of the database now. mode: which of its ways it goes.
  Outcome Run(std::uint64_t mode) {
    ::setenv("FAKE_COLMAP_SCHEMA", kSchemaNames[schema_], 1);
    PipelineOptions options;
    options.database_path = path_;
    options.colmap_path = FAKE_COLMAP_PATH;
    options.work_path = directory_.Path();
    options.num_threads = 2;
    options.ranking.vectors.gmm.num_components = 2;
    options.ranking.vectors.num_training_descriptors = 200;
    options.ranking.vectors.max_num_features = 30;
    options.verification.lock_timeout = 1;
    options.skip_image_pairs_in_same_frame = true;
    options.verification.timeout_per_pair = 2;
    if (mode % 3 == 1) options.strategy = PipelineOptions::Strategy::kExhaustive;
    if (mode % 5 == 1) {
      options.strategy = PipelineOptions::Strategy::kGraphMatch;
      options.ranking.vectors.descriptor = ImageVectorOptions::Descriptor::kFisher;
    }
    if (mode % 4 == 1) options.verification.matcher = VerificationOptions::Matcher::kColmap;
    return RunInChild([&] {
      const StopRequest stop;
      Silent silent;
      RunPipeline(options, stop, silent);
    });
  }

  // Runs and judges.
  void Check(const std::string& name, std::uint64_t mode) {
    const auto kilobytes = static_cast<long>(std::filesystem::file_size(path_) >> 10);
    const Outcome outcome = Run(mode);
    ++num_mutations_;
    if (outcome.kind == Outcome::Kind::kReturned) ++num_returned_;
    EXPECT_TRUE(outcome.kind == Outcome::Kind::kReturned || outcome.kind == Outcome::Kind::kError)
        << name << " " << outcome.Describe();
    if (kMeasuresMemory) {
      if (good_kilobytes_ == 0) MeasureGood();
      EXPECT_LE(outcome.max_kilobytes,
                good_kilobytes_ + kMaxExtraKilobytes + kMaxTimesFile * kilobytes)
          << name << " took too much memory";
    }
    if (std::getenv("GRAPHMATCH_MUTATIONS_VERBOSE") != nullptr) {
      std::cout << name << " " << outcome.Describe() << " (" << outcome.max_kilobytes << " kB)\n";
    }
  }

  void TearDown() override {
    if (num_mutations_ == 0) return;
    std::cout << num_mutations_ << " mutations: " << num_mutations_ - num_returned_
              << " ended with an error, " << num_returned_ << " went through\n";
  }

  TestDirectory directory_;
  std::filesystem::path path_ = directory_.Path() / "database.db";

 private:
  class Silent : public PipelineObserver {
    void OnInfo(const std::string&) override {}
    void OnWarning(const std::string&) override {}
    void OnProgress(const LoopProgress&) override {}
  };

  void MeasureGood() {
    Begin(schema_);
    for (const std::uint64_t mode : {0, 1, 4, 5}) {
      const Outcome outcome = Run(mode);
      EXPECT_EQ(outcome.kind, Outcome::Kind::kReturned) << outcome.Describe();
      good_kilobytes_ = std::max(good_kilobytes_, outcome.max_kilobytes);
    }
  }

  std::size_t schema_ = 0;
  long good_kilobytes_ = 0;
  int num_mutations_ = 0;
  int num_returned_ = 0;
};

// What finds the faults must itself be able to.
TEST_F(Mutation, FaultsAreFound) {
  EXPECT_EQ(RunInChild([] {}).kind, Outcome::Kind::kReturned);
  const Outcome error = RunInChild([] { throw DatabaseError("a reason"); });
  EXPECT_EQ(error.kind, Outcome::Kind::kError);
  EXPECT_EQ(error.message, "a reason");
  EXPECT_EQ(RunInChild([] { throw std::bad_alloc(); }).kind, Outcome::Kind::kOtherException);
  const Outcome crash = RunInChild([] { ::raise(SIGKILL); });
  EXPECT_EQ(crash.kind, Outcome::Kind::kSignal);
  EXPECT_EQ(crash.number, SIGKILL);
  EXPECT_EQ(RunInChild([] { ::raise(SIGALRM); }).Describe(),
            "did not end within " + std::to_string(kMaxSeconds) + " s");
  if (kMeasuresMemory) {
    const auto hold = [](std::size_t size) {
      return RunInChild([size] {
               std::vector<char> memory(size, 1);
               if (memory[size / 2] == 0) throw std::runtime_error("not reached");
             })
          .max_kilobytes;
    };
    EXPECT_GT(hold(std::size_t{100} << 20), hold(1) + (90 << 10));
  }
}

TEST_F(Mutation, NoneAtAll) {
  for (std::size_t schema = 0; schema < kSchemas.size(); ++schema) {
    for (const std::uint64_t mode : {0, 1, 4, 5}) {
      Begin(schema, mode == 4 ? 512 : 4096);
      const Outcome outcome = Run(mode);
      EXPECT_EQ(outcome.kind, Outcome::Kind::kReturned) << outcome.Describe();
      RawDatabase database(path_);
      // Those that were there, and all pairs of a place at least.
      EXPECT_GE(std::stoi(database.Query("SELECT count(*) FROM two_view_geometries")[0]), 401 + 5);
    }
  }
}

// ---- Bytes ----

class Pages {
 public:
  Pages(std::string bytes, int page_size)
      : bytes_(std::move(bytes)), page_size_(static_cast<std::size_t>(page_size)) {}

  // One change of a kind that hurts.
  void Mutate(Random* random) {
    const std::size_t page = random->Index(NumPages()) * page_size_;
    switch (random->Index(13)) {
      case 0:  // A bit anywhere.
        Byte(random->Index(bytes_.size())) ^= static_cast<char>(1 << random->Index(8));
        break;
      case 1:  // The header of the file.
        for (int i = 0; i < 3; ++i) Byte(16 + random->Index(84)) = RandomByte(random);
        break;
      case 2:  // The header of a b-tree page.
        Byte(page + (page == 0 ? 100 : 0) + random->Index(12)) = RandomByte(random);
        break;
      case 3:  // The places of its cells.
        for (int i = 0; i < 4; ++i) Byte(page + 8 + random->Index(40)) = RandomByte(random);
        break;
      case 4:  // Somewhere in a page.
        for (int i = 0; i < 8; ++i) Byte(page + random->Index(page_size_)) = RandomByte(random);
        break;
      case 5:
        std::fill_n(bytes_.begin() + static_cast<std::ptrdiff_t>(page), page_size_, '\0');
        break;
      case 6: {
        const std::size_t other = random->Index(NumPages()) * page_size_;
        const std::string copy = bytes_.substr(page, page_size_);
        bytes_.replace(page, page_size_, bytes_.substr(other, page_size_));
        bytes_.replace(other, page_size_, copy);
        break;
      }
      case 7: {  // A page twice.
        const std::size_t other = random->Index(NumPages()) * page_size_;
        bytes_.replace(page, page_size_, bytes_.substr(other, page_size_));
        break;
      }
      case 8:
        bytes_.resize(1 + random->Index(bytes_.size()));
        bytes_.resize(std::max<std::size_t>(bytes_.size(), 2 * page_size_), '\0');
        break;
      case 9:
        for (std::size_t i = random->Index(3 * page_size_); i > 0; --i) {
          bytes_ += RandomByte(random);
        }
        break;
      case 10:  // The next page of a chain, or the last child; a circle, with luck.
        Put(page + (random->Index(2) == 0 ? 0 : 8), AnyPage(random));
        break;
      case 11:  // The first free page, and how many there are.
        Put(32, AnyPage(random));
        Put(36, static_cast<std::uint32_t>(random->Index(1000)));
        break;
      default:  // A number without end, such as the length of a row.
        bytes_.replace(page + random->Index(page_size_ - 9), 9, 9, '\xFF');
        break;
    }
  }

  // Puts `depth` pages above a table, each with many children that are all the same page: a tree
  // with more rows than could ever be read.
  void MakeEndless(std::size_t root, int depth) {
    const std::size_t header = root == 1 ? 100 : 0;
    const std::size_t start = (root - 1) * page_size_;
    std::string top = bytes_.substr(start, page_size_);
    // Without the header of the file. Cells are found by their distance from the page's start.
    if (header > 0) top.replace(0, page_size_ / 4, top.substr(header, page_size_ / 4));
    bytes_ += top;
    for (int level = 0; level < depth; ++level) {
      const auto child = static_cast<std::uint32_t>(NumPages());
      if (level + 1 < depth) {
        bytes_ += Interior(child, 0);
      } else {
        const std::string interior = Interior(child, header);
        bytes_.replace(start + header, page_size_ - header, interior.substr(header));
      }
    }
    Put(28, static_cast<std::uint32_t>(NumPages()));
  }

  // The file says that it has so many bytes.
  void ClaimSize(std::size_t size) { Put(28, static_cast<std::uint32_t>(size / page_size_)); }

  const std::string& Bytes() const { return bytes_; }

 private:
  std::size_t NumPages() const { return bytes_.size() / page_size_; }
  // Truncated files may have fewer bytes than a page.
  char& Byte(std::size_t place) { return bytes_[place % bytes_.size()]; }
  static char RandomByte(Random* random) {
    static constexpr std::array<int, 6> kNasty = {0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFF};
    return static_cast<char>(random->Index(2) == 0 ? kNasty[random->Index(kNasty.size())]
                                                   : static_cast<int>(random->Index(256)));
  }
  std::uint32_t AnyPage(Random* random) const {
    return static_cast<std::uint32_t>(random->Index(NumPages() + 2));
  }
  void Put(std::size_t place, std::uint32_t value) {
    if (place + 4 <= bytes_.size()) bytes_.replace(place, 4, BigEndian(value));
  }

  // An interior page of a table (https://www.sqlite.org/fileformat.html, 1.6), all children alike.
  std::string Interior(std::uint32_t child, std::size_t header) const {
    constexpr std::size_t kNumCells = 30;
    constexpr std::size_t kCellSize = 5;
    std::string page(page_size_, '\0');
    const std::size_t content = page_size_ - kNumCells * kCellSize;
    page.replace(header, 8,
                 {'\x05', 0, 0, 0, static_cast<char>(kNumCells), static_cast<char>(content >> 8),
                  static_cast<char>(content), 0});
    page.replace(header + 8, 4, BigEndian(child));
    for (std::size_t i = 0; i < kNumCells; ++i) {
      const std::size_t cell = content + i * kCellSize;
      page[header + 12 + 2 * i] = static_cast<char>(cell >> 8);
      page[header + 13 + 2 * i] = static_cast<char>(cell);
      page.replace(cell, 4, BigEndian(child));
      page[cell + 4] = static_cast<char>(100 + i % 20);
    }
    return page;
  }

  std::string bytes_;
  std::size_t page_size_;
};

// AddressSanitizer makes every mutation some five times as slow: a third of them must do there.
#if defined(__SANITIZE_ADDRESS__)
constexpr int kStride = 3;
#else
constexpr int kStride = 1;
#endif

constexpr int kNumParts = 6;
constexpr int kBytesPerPart = 60;

class MutatedBytes : public Mutation, public ::testing::WithParamInterface<int> {};

TEST_P(MutatedBytes, ErrorOrResult) {
  for (int i = 0; i < kBytesPerPart; i += kStride) {
    const int number = kBytesPerPart * GetParam() + i;
    const int page_size = number % 2 == 0 ? 4096 : 512;
    Begin(static_cast<std::size_t>(number) % kSchemas.size(), page_size);
    Random random({17, static_cast<std::uint64_t>(number)});
    Pages pages(ReadFile(path_), page_size);
    for (std::size_t left = random.Index(4) == 0 ? 1 + random.Index(6) : 1; left > 0; --left) {
      pages.Mutate(&random);
    }
    WriteFile(path_, pages.Bytes());
    if (number % 20 == 7) WriteFile(path_.string() + "-journal", pages.Bytes());
    if (number % 20 == 13) WriteFile(path_.string() + "-wal", pages.Bytes());
    Check("Mutation of bytes number " + std::to_string(number), random.Next());
  }
}

INSTANTIATE_TEST_SUITE_P(Part, MutatedBytes, ::testing::Range(0, kNumParts));

TEST_F(Mutation, TablesWithoutEnd) {
  for (const int page_size : {512, 4096}) {
    for (const char* table : {"sqlite_schema", "cameras", "images", "keypoints", "descriptors",
                              "matches", "two_view_geometries", "frame_data"}) {
      for (const int depth : {1, 12}) {
        Begin(table == std::string("frame_data") ? 2 : 0, page_size);
        const std::vector<std::string> root = RawDatabase(path_).Query(
            "SELECT rootpage FROM sqlite_schema WHERE type = 'table' AND "
            "name = '" +
            std::string(table) + "'");
        Pages pages(ReadFile(path_), page_size);
        pages.MakeEndless(root.empty() ? 1 : std::stoul(root[0]), depth);
        WriteFile(path_, pages.Bytes());
        for (const std::uint64_t mode : {0, 1}) {
          Check(std::string(table) + " of endless pages", mode);
        }
      }
    }
  }
}

TEST_F(Mutation, SparseFiles) {
  constexpr std::size_t kSize = std::size_t{1} << 30;
  for (int number = 0; number < 12; ++number) {
    Begin(static_cast<std::size_t>(number) % kSchemas.size());
    Random random({18, static_cast<std::uint64_t>(number)});
    Pages pages(ReadFile(path_), 4096);
    if (number % 2 == 0) pages.ClaimSize(kSize);
    if (number % 4 < 2) pages.Mutate(&random);
    WriteFile(path_, pages.Bytes());
    std::filesystem::resize_file(path_, kSize);
    Check("Sparse file number " + std::to_string(number), random.Next());
  }
}

// ---- Values ----

class MutatedValues : public Mutation, public ::testing::WithParamInterface<std::size_t> {};

TEST_P(MutatedValues, ErrorOrResult) {
  const std::vector<std::string> integers = {"-1",
                                             "0",
                                             "1",
                                             "3",
                                             "2147483646",
                                             "2147483647",
                                             "2147483648",
                                             "4294967297",
                                             "-2147483649",
                                             "576460752303423488",
                                             "9223372036854775807",
                                             "-9223372036854775807 - 1"};
  const std::vector<std::string> others = {"NULL",
                                           "''",
                                           "'text'",
                                           "'41 x'",
                                           "x''",
                                           "x'00FF00'",
                                           "zeroblob(1)",
                                           "0.5",
                                           "1e308",
                                           "-1e999",
                                           "zeroblob(100000)",
                                           "char(0, 10, 27) || 'x'",
                                           "zeroblob(71)",
                                           "randomblob(640)",
                                           "'5120'"};
  const std::size_t schema = GetParam();
  Begin(schema);
  std::vector<std::pair<std::string, std::string>> columns;
  for (const char* table :
       {"cameras", "images", "keypoints", "descriptors", "matches", "two_view_geometries"}) {
    for (const std::string& column : RawDatabase(path_).Query(
             "SELECT name FROM pragma_table_info('" + std::string(table) + "')")) {
      columns.emplace_back(table, column);
    }
  }
  std::uint64_t number = 0;
  for (const auto& [table, column] : columns) {
    const bool is_key = column == "pair_id" || (column == "image_id") ||
                        (column == "camera_id" && table == "cameras");
    Random random({19, schema, number});
    std::vector<std::string> values = integers;
    if (!is_key) values.insert(values.end(), others.begin(), others.end());
    for (int i = 0; i < 5; i += kStride) {
      const std::string value = values[random.Index(values.size())];
      ++number;
      Begin(schema);
      {
        // The first row, or all of them.
        RawDatabase database(path_);
        database.DropConstraints();
        database.Execute("UPDATE OR IGNORE " + table + " SET " + column + " = " + value +
                         (i == 0 ? "" : " WHERE rowid = (SELECT min(rowid) FROM " + table + ")"));
      }
      Check(table + "." + column + " = " + value, number);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Schema, MutatedValues, ::testing::Range<std::size_t>(0, kSchemas.size()));

TEST_F(Mutation, BlobsOfOddNumbers) {
  const std::vector<std::pair<std::string, std::string>> patterns = {
      {"NaN", std::string("\x00\x00\xC0\x7F", 4)},
      {"infinity", std::string("\x00\x00\x80\x7F", 4)},
      {"minus infinity", std::string("\x00\x00\x80\xFF", 4)},
      {"largest", std::string("\xFF\xFF\x7F\x7F", 4)},
      {"denormal", std::string("\x01\x00\x00\x00", 4)},
      {"ones", std::string("\xFF\xFF\xFF\xFF", 4)},
      {"zeros", std::string(4, '\0')}};
  std::uint64_t number = 0;
  for (const auto& [name, pattern] : patterns) {
    for (const auto& [table, size] :
         std::vector<std::pair<std::string, std::size_t>>{{"keypoints", 16 * kNumFeatures},
                                                          {"descriptors", 128 * kNumFeatures},
                                                          {"matches", 160},
                                                          {"two_view_geometries", 160}}) {
      Begin(number % kSchemas.size());
      sqlite::Blob blob;
      while (blob.size() < size) blob.insert(blob.end(), pattern.begin(), pattern.end());
      RawDatabase(path_).ExecuteWith("UPDATE " + table + " SET data = ?1 WHERE length(data) > 0",
                                     blob);
      Check(table + " of " + name, number++);
    }
  }
}

// ---- Statements ----

const char kEndlessView[] =
    " AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS image_id, "
    "i AS pair_id, i AS camera_id, 'a' AS name, 1 AS model, 1 AS width, 1 AS height, NULL AS "
    "params, "
    "1 AS rows, 1 AS cols, NULL AS data, 3 AS config, NULL AS F, NULL AS E, NULL AS H FROM n";

const char kGeometryColumns[] =
    "rows INTEGER, cols INTEGER, data BLOB, config INTEGER, F BLOB, E BLOB, H BLOB";

// Takes for ever, within one instruction of SQLite's virtual machine.
const char kSlow[] = "replace(hex(zeroblob(500000)), '0', 'aa') LIKE '%a%a%a%a%a%a%a%a%a%a%a%b'";

std::vector<std::string> Statements() {
  std::vector<std::string> list;
  const std::string slow = kSlow;
  const auto geometries = [&](const std::string& rest) {
    list.push_back("DROP TABLE two_view_geometries; CREATE TABLE two_view_geometries(" + rest +
                   ")");
  };
  const std::string key = "pair_id INTEGER PRIMARY KEY, ";
  for (const std::string table :
       {"cameras", "images", "keypoints", "descriptors", "matches", "two_view_geometries"}) {
    list.push_back("DROP TABLE " + table);
    list.push_back("DELETE FROM " + table);
    list.push_back("DROP TABLE " + table + "; CREATE VIEW " + table + kEndlessView);
    list.push_back("CREATE TABLE copy AS SELECT * FROM " + table + "; DROP TABLE " + table +
                   "; ALTER TABLE copy RENAME TO " + table);
    list.push_back("DROP TABLE " + table + "; CREATE VIRTUAL TABLE " + table +
                   " USING fts4(image_id, pair_id, camera_id, name, model, width, height, params, "
                   "rows, cols, data, config, F, E, H)");
    list.push_back("DROP TABLE " + table + "; CREATE VIRTUAL TABLE " + table +
                   " USING rtree(image_id, rows, cols)");
    list.push_back("DROP TABLE " + table + "; CREATE TABLE " + table +
                   "(image_id INTEGER, pair_id INTEGER, camera_id INTEGER, name, model, width, "
                   "height, params, rows, cols, data, config, F, E, H, type, PRIMARY KEY(image_id, "
                   "pair_id)) WITHOUT ROWID");
    list.push_back("CREATE TRIGGER harm AFTER INSERT ON " + table +
                   " BEGIN INSERT INTO images(name, camera_id) WITH RECURSIVE n(i) AS (SELECT 1 "
                   "UNION ALL SELECT i + 1 FROM n) SELECT 'x' || i, 1 FROM n; END");
    list.push_back("ALTER TABLE " + table + " ADD COLUMN virtual_column AS (hex(zeroblob(4e8)))");
    list.push_back("ALTER TABLE " + table + " ADD COLUMN \"odd ' \"\" column\" TEXT DEFAULT 'x('");
    list.push_back("PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = 'CREATE VIEW " +
                   table + " AS SELECT 1' WHERE name = '" + table + "'");
    list.push_back(
        "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET rootpage = 1 WHERE name = '" +
        table + "'");
    list.push_back(
        "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = NULL WHERE name = '" + table +
        "'");
    list.push_back(
        "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET rootpage = (SELECT rootpage FROM "
        "sqlite_schema WHERE name = 'descriptors') WHERE name = '" +
        table + "'");
  }
  for (const char* definition :
       {"data_id INTEGER, frame_id INTEGER)", "data_id, frame_id, sensor_type)",
        "data_id INTEGER PRIMARY KEY, frame_id, sensor_type) WITHOUT ROWID"}) {
    list.push_back("DROP TABLE IF EXISTS frame_data; CREATE TABLE frame_data(" +
                   std::string(definition) +
                   "; INSERT INTO frame_data(data_id, frame_id) VALUES(1, 'x'), (2, -1)");
  }
  // Computed when it is read: the rows come first, since that would compute it here.
  list.push_back(
      "DROP TABLE IF EXISTS frame_data; CREATE TABLE frame_data(data_id, frame_id); INSERT INTO "
      "frame_data VALUES(1, 1), (2, 1); ALTER TABLE frame_data ADD COLUMN sensor_type AS "
      "(length(hex(zeroblob(490000000))) * 0)");
  list.push_back(std::string("DROP TABLE IF EXISTS frame_data; CREATE VIEW frame_data") +
                 kEndlessView);
  // Rows without keys, whose joins would have 10^9 rows and more.
  std::string many;
  for (const std::string table : {"images", "keypoints", "descriptors"}) {
    many += "CREATE TABLE copy AS SELECT * FROM " + table + "; DROP TABLE " + table +
            "; CREATE TABLE " + table +
            " AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 1000) "
            "SELECT copy.* FROM n CROSS JOIN copy; DROP TABLE copy;";
  }
  list.push_back(many);
  const std::string columns = kGeometryColumns;
  geometries(key + columns + ", CHECK(" + slow + ")");
  geometries(key + columns + ", slow TEXT DEFAULT (" + slow + ")");
  geometries(key + columns + ", large BLOB DEFAULT (zeroblob(900000000))");
  geometries(key + columns + ", large BLOB AS (zeroblob(900000000)) STORED");
  geometries(key + columns + ", slow AS (" + slow + ") VIRTUAL UNIQUE");
  geometries(key + columns + "); CREATE INDEX slow ON two_view_geometries(" + slow + " + rows");
  geometries(key + columns + "); CREATE INDEX slow ON two_view_geometries(rows) WHERE (" + slow);
  geometries("pair_id INTEGER PRIMARY KEY DESC, " + columns);
  geometries("pair_id TEXT PRIMARY KEY, " + columns);
  geometries(key + columns + ", must TEXT NOT NULL");
  geometries(key + "rows INTEGER UNIQUE, cols INTEGER, data BLOB, config INTEGER, F, E, H");
  for (const char* id :
       {"0", "-1", "2147483647", "2147483648", "9223372036854775807", "-9223372036854775807"}) {
    list.push_back("INSERT INTO matches VALUES(" + std::string(id) + ", 20, 2, zeroblob(160))");
    list.push_back("INSERT INTO two_view_geometries(pair_id, rows, cols, config) VALUES(" +
                   std::string(id) + ", 20, 2, 3)");
  }
  for (const std::string& id :
       {std::to_string(5 * kMaxNumImages + 5), std::to_string(3 * kMaxNumImages + 1), Key(1, 7),
        Key(1, 99), Key(2147483645, 2147483646)}) {
    list.push_back("INSERT INTO matches VALUES(" + id + ", 20, 2, zeroblob(160))");
    list.push_back("INSERT INTO two_view_geometries(pair_id, rows, cols, config) VALUES(" + id +
                   ", 20, 2, 3)");
  }
  for (const char* version : {"-2147483648", "2147483647", "0", "1"}) {
    list.push_back("PRAGMA user_version = " + std::string(version));
  }
  list.push_back(
      "CREATE TABLE copy(image_id INTEGER PRIMARY KEY, name, camera_id); INSERT INTO copy "
      "SELECT image_id, 'same', camera_id FROM images; DROP TABLE images; ALTER TABLE "
      "copy RENAME TO images");
  list.push_back("UPDATE images SET image_id = 2147483646 WHERE image_id = 6");
  list.push_back(
      "UPDATE images SET name = replace(hex(zeroblob(500000)), '0', 'name') "
      "WHERE image_id = 2");
  list.push_back("ANALYZE; UPDATE sqlite_stat1 SET stat = '1 1'");
  list.push_back("ANALYZE; UPDATE sqlite_stat1 SET stat = '9223372036854775807 -1 x'");
  list.push_back("PRAGMA foreign_keys = OFF; UPDATE images SET camera_id = 77");
  list.push_back(
      "CREATE TABLE sequence(a); PRAGMA writable_schema = ON; DELETE FROM sqlite_schema "
      "WHERE name = 'sqlite_sequence'");
  list.push_back(
      "CREATE VIEW harmless AS SELECT * FROM images; CREATE INDEX more ON images(length("
      "name))");
  return list;
}

class MutatedStatements : public Mutation, public ::testing::WithParamInterface<std::size_t> {};

constexpr std::size_t kStatementParts = 4;

TEST_P(MutatedStatements, ErrorOrResult) {
  const std::vector<std::string> statements = Statements();
  for (std::size_t i = GetParam(); i < statements.size(); i += kStatementParts) {
    Begin(i % kSchemas.size());
    RawDatabase(path_).Execute(statements[i]);
    Check(statements[i], i);
  }
}

INSTANTIATE_TEST_SUITE_P(Part, MutatedStatements,
                         ::testing::Range<std::size_t>(0, kStatementParts));

}  // namespace
}  // namespace colmap_graphmatch
