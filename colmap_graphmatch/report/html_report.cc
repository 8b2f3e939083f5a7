#include "colmap_graphmatch/report/html_report.h"

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "colmap_graphmatch/report/page_parts.h"

namespace colmap_graphmatch {
namespace {

// The same JSON without white space between its tokens, and so that nothing in it can end the
// script element that it is put into. Outside of strings JSON has none of the characters that are
// escaped.
std::string InertJson(std::string_view json) {
  std::string text;
  text.reserve(json.size());
  bool in_string = false;
  bool escaped = false;
  for (const char c : json) {
    if (!in_string && (c == ' ' || c == '\n' || c == '\r' || c == '\t')) continue;
    if (c == '"' && !escaped) in_string = !in_string;
    escaped = c == '\\' && !escaped;
    switch (c) {
      case '<':
        text += "\\u003c";
        break;
      case '>':
        text += "\\u003e";
        break;
      case '&':
        text += "\\u0026";
        break;
      default:
        text += c;
    }
  }
  return text;
}

void AppendBase64(std::string_view bytes, std::string* text) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group <<= 8;
      if (i + k < bytes.size()) group |= static_cast<unsigned char>(bytes[i + k]);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      *text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
  }
}

std::string ThumbnailsJson(const std::map<std::size_t, std::string>& thumbnails) {
  std::string json = "{";
  for (const auto& [image, jpeg] : thumbnails) {
    if (json.size() > 1) json += ",";
    json += "\"" + std::to_string(image) + "\":\"";
    AppendBase64(jpeg, &json);
    json += "\"";
  }
  return json + "}";
}

}  // namespace

std::string MakeHtmlReport(const std::string& json,
                           const std::map<std::size_t, std::string>& thumbnails) {
  const std::string page = PageHtml();
  const std::vector<std::pair<std::string_view, std::string>> parts = {
      {"{{page.css}}", PageCss()},
      {"{{d3.min.js}}", D3()},
      {"{{report}}", InertJson(json)},
      {"{{thumbnails}}", ThumbnailsJson(thumbnails)},
      {"{{page.js}}", PageJs()}};
  // The page names its parts in this order, so that nothing is looked for in what was put in.
  std::string html;
  std::size_t end = 0;
  for (const auto& [name, part] : parts) {
    const std::size_t begin = page.find(name, end);
    html.append(page, end, begin - end).append(part);
    end = begin + name.size();
  }
  return html.append(page, end, std::string::npos);
}

}  // namespace colmap_graphmatch
