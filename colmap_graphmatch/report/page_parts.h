#pragma once

#include <string>

namespace colmap_graphmatch {

// What the page of a report is put together from: the files in report/page and D3, as they are.
// cmake/embed_files.cmake writes the definitions when the library is built.
std::string PageHtml();
std::string PageCss();
std::string PageJs();
std::string D3();

}  // namespace colmap_graphmatch
