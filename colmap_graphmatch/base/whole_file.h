#pragma once

#include <filesystem>
#include <functional>
#include <ostream>

namespace colmap_graphmatch {

// Writes a file under another name (PATH.partial) and then gives it its own: at no time is there a
// half-written one. Throws FileError.
void WriteWholeFile(const std::filesystem::path& path,
                    const std::function<void(std::ostream&)>& write);

// Whether that can be expected to go well, before something is computed for long. Leaves what is
// there. Throws FileError.
void CheckCanWrite(const std::filesystem::path& path);

}  // namespace colmap_graphmatch
