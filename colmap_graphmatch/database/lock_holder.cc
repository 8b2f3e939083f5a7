#include "colmap_graphmatch/database/lock_holder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <set>
#include <sstream>

namespace colmap_graphmatch {

std::string DescribeLockHolders(const std::filesystem::path& database_path) {
  // SQLite locks the database itself and, in write-ahead mode, the -shm file beside it.
  std::set<std::string> inodes;
  for (const char* suffix : {"", "-shm"}) {
    struct stat status = {};
    if (::stat((database_path.string() + suffix).c_str(), &status) == 0) {
      inodes.insert(std::to_string(status.st_ino));
    }
  }

  // "1: POSIX  ADVISORY  WRITE 1234 fe:00:393241 120 120"
  // Every program that has the database open in write-ahead mode holds a READ lock: innocent, as
  // long as there is a writer.
  std::set<long> writers;
  std::set<long> readers;
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream fields(line);
    std::string number, kind, strictness, access, file;
    long pid = 0;
    fields >> number >> kind >> strictness >> access >> pid >> file;
    const std::string inode = file.substr(file.rfind(':') + 1);
    if (pid > 0 && pid != ::getpid() && inodes.count(inode) > 0) {
      (access == "WRITE" ? writers : readers).insert(pid);
    }
  }

  std::string holders;
  for (const long pid : writers.empty() ? readers : writers) {
    std::string command = "?";
    std::ifstream("/proc/" + std::to_string(pid) + "/comm") >> command;
    holders +=
        (holders.empty() ? "held by process " : ", ") + std::to_string(pid) + " (" + command + ")";
  }
  return holders.empty() ? "perhaps a colmap, a COLMAP window or another matcher that has it open"
                         : holders;
}

}  // namespace colmap_graphmatch
