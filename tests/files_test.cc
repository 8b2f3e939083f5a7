#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/base/output_file.h"
#include "colmap_graphmatch/base/random_name.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

class FilesTest : public ::testing::Test {
 protected:
  FilesTest() : directory_(std::filesystem::temp_directory_path() / ("files-" + RandomName())) {
    std::filesystem::create_directory(directory_);
  }
  ~FilesTest() override { std::filesystem::remove_all(directory_); }

  static std::string Content(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  static void Write(const std::filesystem::path& path, const std::string& text) {
    WriteWholeFile(path, [&](std::ostream& file) { file << text; });
  }

  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
      names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  std::filesystem::path Pipe(const std::string& name) const {
    EXPECT_EQ(::mkfifo((directory_ / name).c_str(), 0600), 0);
    return directory_ / name;
  }

  std::filesystem::path Database(const std::string& name) const {
    std::ofstream(directory_ / name) << "SQLite format 3" << '\0' << std::string(84, 'x');
    return directory_ / name;
  }

  std::filesystem::path directory_;
};

TEST_F(FilesTest, AFileIsReplacedAsAWhole) {
  const std::filesystem::path path = directory_ / "a report.json";
  Write(path, "first");
  EXPECT_EQ(Content(path), "first");
  std::ofstream reader_of_the_old(path, std::ios::app);
  EXPECT_THROW(WriteWholeFile(path,
                              [&](std::ostream& file) {
                                file << "second";
                                EXPECT_EQ(Content(path), "first");
                                throw FileError("no more");
                              }),
               FileError);
  EXPECT_EQ(Content(path), "first");
  Write(path, std::string(1000000, 'x'));
  EXPECT_EQ(Content(path), std::string(1000000, 'x'));
  EXPECT_THAT(Names(), ElementsAre("a report.json"));
}

TEST_F(FilesTest, WhatLiesBesideIsNotTouched) {
  std::ofstream(directory_ / "pairs.txt.partial") << "precious";
  std::ofstream(directory_ / "victim") << "precious";
  std::filesystem::create_symlink("victim", directory_ / "list.txt.partial");
  for (const char* name : {"pairs.txt", "list.txt"}) {
    CheckCanWrite(directory_ / name);
    Write(directory_ / name, "new");
  }
  EXPECT_EQ(Content(directory_ / "pairs.txt.partial"), "precious");
  EXPECT_EQ(Content(directory_ / "victim"), "precious");
  EXPECT_TRUE(std::filesystem::is_symlink(directory_ / "list.txt.partial"));
}

TEST_F(FilesTest, LinksStayAndTheirTargetsAreWritten) {
  std::filesystem::create_directory(directory_ / "elsewhere");
  std::ofstream(directory_ / "elsewhere" / "old") << "old";
  std::filesystem::create_symlink("elsewhere/old", directory_ / "to old");
  std::filesystem::create_symlink("to old", directory_ / "to a link");
  std::filesystem::create_symlink(directory_ / "elsewhere" / "new", directory_ / "to new");
  Write(directory_ / "to a link", "1");
  Write(directory_ / "to new", "2");
  EXPECT_EQ(Content(directory_ / "elsewhere" / "old"), "1");
  EXPECT_EQ(Content(directory_ / "elsewhere" / "new"), "2");
  for (const char* name : {"to old", "to a link", "to new"}) {
    EXPECT_TRUE(std::filesystem::is_symlink(directory_ / name)) << name;
  }
  std::filesystem::create_symlink("b", directory_ / "a");
  std::filesystem::create_symlink("a", directory_ / "b");
  EXPECT_THROW(Write(directory_ / "a", "x"), FileError);
}

TEST_F(FilesTest, RightsStayWhatTheyWere) {
  const std::filesystem::path path = directory_ / "private";
  Write(path, "1");
  std::filesystem::permissions(
      path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  Write(path, "2");
  EXPECT_EQ(std::filesystem::status(path).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST_F(FilesTest, PipesAndDevicesAreWrittenTo) {
  const std::filesystem::path pipe = Pipe("pipe");
  CheckCanWrite(pipe);
  EXPECT_THAT([&] { Write(pipe, "x"); },
              ThrowsMessage<FileError>(HasSubstr("no program reads from this pipe")));
  std::string read;
  std::thread reader([&] { read = Content(pipe); });
  // Until the reader has opened it, it is an error.
  for (bool is_written = false; !is_written;) {
    try {
      Write(pipe, std::string(200000, 'y'));
      is_written = true;
    } catch (const FileError&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  reader.join();
  EXPECT_EQ(read, std::string(200000, 'y'));
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));

  CheckCanWrite("/dev/null");
  Write("/dev/null", "x");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_THAT([&] { Write("/dev/full", "x"); },
              ThrowsMessage<FileError>(HasSubstr("No space left on device")));
}

TEST_F(FilesTest, WhatTheProgramHasOpenIsWrittenOnWith) {
  const std::filesystem::path path = directory_ / "output";
  std::ofstream(path) << "before\n";
  const int number = ::open(path.c_str(), O_RDWR);
  struct stat before = {};
  ::fstat(number, &before);
  std::filesystem::create_symlink("/dev/fd/" + std::to_string(number), directory_ / "link");
  ::lseek(number, 0, SEEK_END);
  Write("/dev/fd/" + std::to_string(number), "1\n");
  Write("/proc/self/fd/" + std::to_string(number), "2\n");
  Write(directory_ / "link", "3\n");
  // What is printed there by other means comes behind.
  EXPECT_EQ(::write(number, "4\n", 2), 2);
  struct stat after = {};
  ::stat(path.c_str(), &after);
  ::close(number);
  EXPECT_EQ(before.st_ino, after.st_ino);
  EXPECT_EQ(Content(path), "before\n1\n2\n3\n4\n");
}

TEST_F(FilesTest, DatabasesAndWhatBelongsToThemAreNeverWritten) {
  const std::filesystem::path database = Database("other.db");
  const std::string content = Content(database);
  std::filesystem::create_symlink("other.db", directory_ / "link.txt");
  for (const char* name :
       {"other.db", "link.txt", "other.db-wal", "other.db-shm", "other.db-journal"}) {
    const std::filesystem::path path = directory_ / name;
    EXPECT_THROW(CheckCanWrite(path), FileError) << name;
    EXPECT_THROW(Write(path, "x"), FileError) << name;
    EXPECT_THROW(GrowingFile(path, GrowingFile::Mode::kAppend), FileError) << name;
  }
  EXPECT_EQ(Content(database), content);
  EXPECT_THAT(Names(), ElementsAre("link.txt", "other.db"));
  std::ofstream(directory_ / "photo.jpg") << "\xFF\xD8\xFF\xE0";
  EXPECT_THAT([&] { Write(directory_ / "photo.jpg", "x"); },
              ThrowsMessage<FileError>(HasSubstr("it is a photo")));
  // Without such a database it is a name like others.
  Write(directory_ / "a-wal", "x");
}

TEST_F(FilesTest, WhatCannotBeWrittenIsKnownBefore) {
  EXPECT_THAT([&] { CheckCanWrite(directory_); },
              ThrowsMessage<FileError>(HasSubstr("Is a directory")));
  EXPECT_THAT([&] { CheckCanWrite(directory_ / "none" / "report"); },
              ThrowsMessage<FileError>(HasSubstr("No such file or directory")));
  EXPECT_THAT([&] { CheckCanWrite(directory_ / std::string(300, 'x')); },
              ThrowsMessage<FileError>(HasSubstr("File name too long")));
  // The longest name that there is leaves no room for a suffix.
  Write(directory_ / std::string(255, 'x'), "1");
  EXPECT_THAT(Names(), ElementsAre(std::string(255, 'x')));
}

TEST_F(FilesTest, ALogGrows) {
  const std::filesystem::path path = directory_ / "log";
  std::ofstream(path) << "before\n";
  {
    GrowingFile file(path, GrowingFile::Mode::kAppend);
    file << "1\n" << std::flush;
    EXPECT_EQ(Content(path), "before\n1\n");
    file << "2\n";
  }
  EXPECT_EQ(Content(path), "before\n1\n2\n");
  { GrowingFile(path, GrowingFile::Mode::kAnew) << "3\n"; }
  EXPECT_EQ(Content(path), "3\n");
  GrowingFile full("/dev/full", GrowingFile::Mode::kAppend);
  full << "x" << std::flush;
  EXPECT_EQ(full.Error(), ENOSPC);
  EXPECT_FALSE(full);
}

TEST_F(FilesTest, TextComesFromFilesAndFromPipes) {
  std::ofstream(directory_ / "list") << "a\nb\n";
  EXPECT_EQ(ReadText(directory_ / "list", nullptr), "a\nb\n");
  const std::filesystem::path pipe = Pipe("pipe");
  std::thread writer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::ofstream(pipe) << std::string(200000, 'x');
  });
  EXPECT_EQ(ReadText(pipe, nullptr), std::string(200000, 'x'));
  writer.join();
}

TEST_F(FilesTest, APipeWithoutAWriterIsWaitedForAsLongAsTheUserWants) {
  const std::filesystem::path pipe = Pipe("pipe");
  StopRequest stop;
  std::thread user([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop.Raise();
  });
  EXPECT_THROW(ReadText(pipe, &stop), StoppedError);
  user.join();
}

TEST_F(FilesTest, NothingElseIsRead) {
  EXPECT_THAT([&] { ReadText(directory_, nullptr); },
              ThrowsMessage<FileError>(HasSubstr("Is a directory")));
  EXPECT_THAT([] { ReadText("/dev/zero", nullptr); },
              ThrowsMessage<FileError>(HasSubstr("it is a device")));
  EXPECT_THAT([] { OpenRegularFile("/dev/zero"); },
              ThrowsMessage<FileError>(HasSubstr("it is a device")));
  EXPECT_THAT([&] { OpenRegularFile(Pipe("pipe")); },
              ThrowsMessage<FileError>(HasSubstr("it is a pipe")));
  EXPECT_THAT([&] { OpenRegularFile(directory_ / "none"); },
              ThrowsMessage<FileError>(HasSubstr("No such file")));
  EXPECT_THAT(WhyNotRegular(directory_ / "none"), IsEmpty());
  EXPECT_THAT(WhyNotRegular("/dev/null"), StartsWith("it is a device"));
}

TEST_F(FilesTest, PhotosLieBelowTheirDirectory) {
  const std::filesystem::path photos = directory_ / "photos";
  std::filesystem::create_directories(photos / "day 1");
  std::ofstream(photos / "day 1" / "a.jpg") << "jpeg";
  std::ofstream(directory_ / "secret") << "secret";
  std::ofstream(photos / "empty.jpg");
  std::ofstream(photos / "great.jpg");
  std::filesystem::resize_file(photos / "great.jpg", (std::uintmax_t{1} << 30U) + 1);
  ASSERT_EQ(::mkfifo((photos / "pipe.jpg").c_str(), 0600), 0);
  std::filesystem::create_symlink("day 1/a.jpg", photos / "link.jpg");
  std::filesystem::create_symlink("/dev/zero", photos / "zero.jpg");
  EXPECT_THAT(ReadPhoto(photos, "day 1/a.jpg"), ElementsAre('j', 'p', 'e', 'g'));
  EXPECT_THAT(ReadPhoto(photos, "link.jpg"), ElementsAre('j', 'p', 'e', 'g'));
  EXPECT_THAT(ReadPhoto(photos, "day 1/../day 1/a.jpg"), ElementsAre('j', 'p', 'e', 'g'));
  for (const std::string& name :
       {std::string("../secret"), std::string("day 1/../../secret"),
        (directory_ / "secret").string(), std::string("/dev/zero"), std::string("none.jpg"),
        std::string("empty.jpg"), std::string("great.jpg"), std::string("pipe.jpg"),
        std::string("zero.jpg"), std::string("day 1"), std::string(), std::string(".")}) {
    EXPECT_THROW(ReadPhoto(photos, name), UnreadableFileError) << name;
  }
}

}  // namespace
}  // namespace colmap_graphmatch
