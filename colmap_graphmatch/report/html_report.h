#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace colmap_graphmatch {

// One HTML file that shows a report in a browser, without a network and without other files: style,
// code, data and thumbnails are in it. json is what MakeJsonReport returns (docs/formats.md);
// thumbnails are JPEG files by the images' indices, as MakeThumbnails returns them, and may be
// empty.
//
// Whatever text the report holds (names of images above all) is shown as text: it is inert in the
// file, and the page's code never makes HTML of it.
std::string MakeHtmlReport(const std::string& json,
                           const std::map<std::size_t, std::string>& thumbnails);

}  // namespace colmap_graphmatch
