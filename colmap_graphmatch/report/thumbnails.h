#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/report/report_data.h"

namespace colmap_graphmatch {

// The images that the page of a report shows thumbnails of, by index and name, ascending: all up to
// max_num_thumbnails; of more, those that its lists show, most telling first: images without an
// edge and their nearest candidates, the ends of bridges, articulation points, the ends of weak
// links, then of every component, largest first, the images with most neighbours.
std::vector<std::pair<std::size_t, std::string>> ChooseThumbnails(
    const ReportDetails& details, std::size_t max_num_thumbnails = 1000);

// JPEG files of at most 128 x 128 pixels of the images (index and name, a path below image_path),
// by index. The orientation that a camera has noted is honoured. Files that are missing or cannot
// be decoded are left out, and so are those that are not below image_path, whatever their name
// says: a page may be sent to others. When stop asks for it, all others are left out, too.
std::map<std::size_t, std::string> MakeThumbnails(
    const std::filesystem::path& image_path,
    const std::vector<std::pair<std::size_t, std::string>>& images, ThreadPool& threads,
    const StopRequest& stop);

}  // namespace colmap_graphmatch
