#pragma once

#include <filesystem>
#include <string>

#include "colmap_graphmatch/report/report_data.h"

namespace colmap_graphmatch {

// A report for other programs: a JSON object, the members of which docs/formats.md describes.
std::string MakeJsonReport(const ReportData& data);

// Whether the report at such a path is a page: its name ends in .html or .htm.
bool IsPage(const std::filesystem::path& report_path);

// Where the object goes: to the path, or if that is a page beside it, with .json instead.
std::filesystem::path JsonReportPath(std::filesystem::path report_path);

// Whether there is such an object in a file.
bool IsJsonReport(const std::filesystem::path& path);

}  // namespace colmap_graphmatch
