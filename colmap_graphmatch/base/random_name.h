#pragma once

#include <string>

namespace colmap_graphmatch {

// 16 letters and digits that nobody can guess, for files and directories that nobody else is to
// have.
std::string RandomName();

}  // namespace colmap_graphmatch
