#include "colmap_graphmatch/base/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <streambuf>
#include <string>
#include <system_error>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/file_descriptor.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/base/random_name.h"

namespace colmap_graphmatch {

namespace {

[[noreturn]] void Fail(const std::filesystem::path& path, const std::string& reason) {
  throw FileError("Cannot write " + path.string() + ": " + reason + ".");
}

[[noreturn]] void FailWith(const std::filesystem::path& path, int error) {
  Fail(path, std::strerror(error));
}

// Gives a file the rights of the one whose place it takes: who may not read that may not read this.
void TakeAfter(const struct stat& status, int number) {
  mode_t mode = status.st_mode & 0777U;
  // Root alone may give a file away, and others only to a group of theirs.
  const bool is_of_the_group = ::fchown(number, status.st_uid, status.st_gid) == 0 ||
                               ::fchown(number, static_cast<uid_t>(-1), status.st_gid) == 0;
  if (!is_of_the_group) mode &= ~static_cast<mode_t>(S_IRWXG);
  ::fchmod(number, mode);
}

// Where the output goes.
struct Target {
  std::filesystem::path path;  // Not a link.
  bool is_new = true;
  bool is_replaced = true;  // Else it is written to.
  struct stat status = {};  // Of what is there.
  int descriptor = -1;      // Of this process, which has it open.
};

// Whether a path leads into /dev or /proc.
bool IsOfTheSystem(const std::filesystem::path& path) {
  std::error_code ignored;
  const std::filesystem::path directory =
      std::filesystem::weakly_canonical(std::filesystem::absolute(path).parent_path(), ignored);
  const auto first = directory.begin() == directory.end() ? directory.end() : ++directory.begin();
  return directory == "/dev" || (first != directory.end() && *first == "proc");
}

// The descriptor of this process that a path in /dev or /proc stands for; negative: none.
int DescriptorOf(const std::filesystem::path& path) {
  if (path == "/dev/stdout") return STDOUT_FILENO;
  if (path == "/dev/stderr") return STDERR_FILENO;
  std::error_code ignored;
  const std::filesystem::path own =
      std::filesystem::canonical("/proc/self/fd", ignored);  // /proc/PID/fd
  const std::string name = path.filename().string();
  const bool is_number =
      !name.empty() && name.size() < 8 && name.find_first_not_of("0123456789") == std::string::npos;
  return is_number && std::filesystem::canonical(path.parent_path(), ignored) == own
             ? std::stoi(name)
             : -1;
}

Target FindTarget(const std::filesystem::path& path) {
  // As many links as Linux follows.
  constexpr int kMaxNumLinks = 40;
  Target target;
  target.path = path;
  for (int i = 0; i <= kMaxNumLinks; ++i) {
    struct stat status = {};
    // A link in /dev or /proc leads to what this process has open: to be written to, whatever it
    // is.
    const bool is_of_the_system = IsOfTheSystem(target.path);
    const int result = is_of_the_system ? ::stat(target.path.c_str(), &status)
                                        : ::lstat(target.path.c_str(), &status);
    if (result != 0) {
      if (errno != ENOENT) FailWith(path, errno);
      return target;
    }
    if (!S_ISLNK(status.st_mode)) {
      if (S_ISDIR(status.st_mode)) FailWith(path, EISDIR);
      target.is_new = false;
      target.is_replaced = S_ISREG(status.st_mode) && !is_of_the_system;
      if (is_of_the_system) target.descriptor = DescriptorOf(target.path);
      target.status = status;
      return target;
    }
    std::error_code error;
    const std::filesystem::path next = std::filesystem::read_symlink(target.path, error);
    if (error) Fail(path, error.message());
    target.path = target.path.parent_path() / next;  // An absolute one takes its place.
  }
  FailWith(path, ELOOP);
}

void ProtectInputs(const std::filesystem::path& path, const Target& target) {
  if (target.is_replaced && !target.is_new) {
    const std::string kind = IsSqliteFile(target.path)  ? "a SQLite database"
                             : IsPhotoFile(target.path) ? "a photo"
                                                        : "";
    if (!kind.empty()) {
      Fail(path, "it is " + kind + ". Name another file, or delete this one first");
    }
  }
  for (const char* suffix : {"-wal", "-shm", "-journal"}) {
    const std::string name = target.path.string();
    const std::size_t size = std::strlen(suffix);
    if (name.size() <= size || name.compare(name.size() - size, size, suffix) != 0) continue;
    const std::string database = name.substr(0, name.size() - size);
    if (!IsSqliteFile(database)) continue;
    Fail(path,
         "SQLite keeps there what belongs to the database " + database + ". Name another file");
  }
}

// Opens what is not replaced.
int OpenInPlace(const std::filesystem::path& path, const Target& target, int flags) {
  if (target.descriptor >= 0) {
    // Not opened anew: what is printed there as well would be written over it.
    const int copy = ::fcntl(target.descriptor, F_DUPFD_CLOEXEC, 0);
    if (copy < 0) FailWith(path, errno);
    return copy;
  }
  // Without a reader a pipe would be waited for.
  const int number = ::open(target.path.c_str(),
                            O_WRONLY | O_CREAT | O_CLOEXEC | O_NOCTTY | O_NONBLOCK | flags, 0666);
  if (number < 0 && errno == ENXIO && S_ISFIFO(target.status.st_mode)) {
    Fail(path, "no program reads from this pipe. Start the reader first");
  }
  if (number < 0) FailWith(path, errno);
  ::fcntl(number, F_SETFL, ::fcntl(number, F_GETFL) & ~O_NONBLOCK);
  return number;
}

struct NewFile {
  int number = -1;
  std::filesystem::path path;
};

// Makes a file that is to take the place of the target.
NewFile MakeBeside(const std::filesystem::path& path, const Target& target) {
  NewFile file;
  file.path = std::filesystem::absolute(target.path).parent_path() /
              (".graphmatch-" + RandomName() + ".partial");
  file.number =
      ::open(file.path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file.number < 0) FailWith(path, errno);
  return file;
}

}  // namespace

// What is written to an open file.
class DescriptorBuffer : public std::streambuf {
 public:
  explicit DescriptorBuffer(int number) : file_(number) { Clear(); }
  ~DescriptorBuffer() override { Flush(); }
  DescriptorBuffer(const DescriptorBuffer&) = delete;
  DescriptorBuffer& operator=(const DescriptorBuffer&) = delete;

  int Error() const { return error_; }

  // Returns the errno of what failed, or 0.
  int Close(bool to_disk) {
    Flush();
    if (error_ == 0 && to_disk && ::fsync(file_.Number()) != 0) error_ = errno;
    if (!file_.Close() && error_ == 0) error_ = errno;
    return error_;
  }

 protected:
  int_type overflow(int_type letter) override {
    Flush();
    if (error_ != 0) return traits_type::eof();
    if (!traits_type::eq_int_type(letter, traits_type::eof())) {
      *pptr() = traits_type::to_char_type(letter);
      pbump(1);
    }
    return traits_type::not_eof(letter);
  }

  int sync() override {
    Flush();
    return error_ == 0 ? 0 : -1;
  }

 private:
  void Clear() { setp(bytes_.data(), bytes_.data() + bytes_.size()); }

  void Flush() {
    const char* data = pbase();
    while (data < pptr() && error_ == 0) {
      const ssize_t size = ::write(file_.Number(), data, static_cast<std::size_t>(pptr() - data));
      if (size >= 0) {
        data += size;
      } else if (errno != EINTR) {
        error_ = errno;
      }
    }
    Clear();
  }

  FileDescriptor file_;
  int error_ = 0;  // Of the first write that failed.
  std::array<char, 65536> bytes_ = {};
};

namespace {

int OpenToGrow(const std::filesystem::path& path, GrowingFile::Mode mode) {
  const Target target = FindTarget(path);
  ProtectInputs(path, target);
  const bool is_emptied = mode == GrowingFile::Mode::kAnew && target.is_replaced;
  return OpenInPlace(path, target, is_emptied ? O_TRUNC : O_APPEND);
}

// Calls write with a stream to the open file. Returns the errno of what failed, or 0.
int WriteAndClose(int number, bool to_disk, const std::function<void(std::ostream&)>& write) {
  DescriptorBuffer buffer(number);
  std::ostream stream(&buffer);
  write(stream);
  return buffer.Close(to_disk);
}

// Removes a file at the end of its scope, unless it has got its name by then.
class Temporary {
 public:
  explicit Temporary(std::filesystem::path path) : path_(std::move(path)) {}
  ~Temporary() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove(path_, ignored);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  // Returns the errno of what failed, or 0.
  int Rename(const std::filesystem::path& name) {
    if (::rename(path_.c_str(), name.c_str()) != 0) return errno;
    // The name is on the disk when the directory is. Not every file system can say so.
    const FileDescriptor directory(
        ::open(name.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (directory.Number() >= 0) ::fsync(directory.Number());
    path_.clear();
    return 0;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace

GrowingFile::GrowingFile(const std::filesystem::path& path, Mode mode)
    : std::ostream(nullptr), buffer_(std::make_unique<DescriptorBuffer>(OpenToGrow(path, mode))) {
  rdbuf(buffer_.get());
}

GrowingFile::~GrowingFile() { rdbuf(nullptr); }

int GrowingFile::Error() const { return buffer_->Error(); }

void WriteWholeFile(const std::filesystem::path& path,
                    const std::function<void(std::ostream&)>& write) {
  const Target target = FindTarget(path);
  ProtectInputs(path, target);
  if (!target.is_replaced) {
    const int error = WriteAndClose(OpenInPlace(path, target, O_APPEND), false, write);
    if (error != 0) FailWith(path, error);
    return;
  }
  const NewFile file = MakeBeside(path, target);
  Temporary temporary(file.path);
  if (!target.is_new) TakeAfter(target.status, file.number);
  int error = WriteAndClose(file.number, true, write);
  if (error == 0) error = temporary.Rename(std::filesystem::absolute(target.path));
  if (error != 0) FailWith(path, error);
}

bool IsReplacedAsAWhole(const std::filesystem::path& path) { return FindTarget(path).is_replaced; }

void CheckCanWrite(const std::filesystem::path& path) {
  const Target target = FindTarget(path);
  ProtectInputs(path, target);
  if (target.descriptor >= 0) return;
  if (!target.is_new && ::access(target.path.c_str(), W_OK) != 0) FailWith(path, errno);
  // A pipe is not opened: its reader would take the end of this check for the end of the file.
  if (!target.is_replaced) return;
  const NewFile file = MakeBeside(path, target);
  const Temporary temporary(file.path);
  ::close(file.number);
}

}  // namespace colmap_graphmatch
