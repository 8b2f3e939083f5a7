#pragma once

#include <filesystem>
#include <string>

namespace colmap_graphmatch {

// Which other processes hold locks on a SQLite database, for a message to the user, e.g.
// "held by process 4711 (colmap)". Read from /proc/locks: opening and closing the file to ask would
// drop the locks that this process itself holds on it (POSIX advisory locks belong to the process).
std::string DescribeLockHolders(const std::filesystem::path& database_path);

}  // namespace colmap_graphmatch
