#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/report/html_report.h"
#include "colmap_graphmatch/report/json_report.h"
#include "colmap_graphmatch/report/report_data.h"
#include "colmap_graphmatch/report/thumbnails.h"
#include "tests/support/synthetic_database.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Images = std::vector<std::pair<std::size_t, std::string>>;
using Json = nlohmann::json;

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

std::string Between(const std::string& text, const std::string& begin, const std::string& end) {
  const std::size_t first = text.find(begin) + begin.size();
  return text.substr(first, text.find(end, first) - first);
}

std::string ReportInside(const std::string& html) {
  return Between(html, "id=\"report-data\">", "</script>");
}

TEST(HtmlReport, NamesCannotBecomePartOfThePage) {
  const std::vector<std::string> names = {"</script><img src=x onerror=alert(1)>",
                                          "<!--<script>",
                                          "]]> & \" ' \\",
                                          "{{page.js}}",
                                          "  two  spaces\t and \n a line",
                                          "a quote at the end\\\"",
                                          "\xc3\xbc\xe2\x80\xa8"};
  const Json report = {{"image_names", names}, {"version", 1}};
  const std::string html = MakeHtmlReport(report.dump(2), {});
  const std::string harmless = MakeHtmlReport("{}", {});
  for (const char* part : {"</script", "<script", "<!--", "<img", "-->"}) {
    EXPECT_EQ(Count(html, part), Count(harmless, part)) << part;
  }
  EXPECT_EQ(Json::parse(ReportInside(html)), report);
}

TEST(HtmlReport, WhiteSpaceBetweenTokensIsLeftOut) {
  EXPECT_EQ(ReportInside(MakeHtmlReport("{\n  \"a b\": [1, 2,\t\"c  d\"]\r\n}\n", {})),
            "{\"a b\":[1,2,\"c  d\"]}");
}

TEST(HtmlReport, ThumbnailsInBase64) {
  const std::string html = MakeHtmlReport(
      "{}", {{0, "Man"}, {7, "Ma"}, {8, "M"}, {9, std::string("\x00\xff\xfe", 3)}, {11, ""}});
  EXPECT_EQ(Between(html, "id=\"thumbnail-data\">", "</script>"),
            "{\"0\":\"TWFu\",\"7\":\"TWE=\",\"8\":\"TQ==\",\"9\":\"AP/+\",\"11\":\"\"}");
}

TEST(HtmlReport, NeedsNothingElse) {
  const std::string html = MakeHtmlReport("{}", {});
  for (const char* part : {"src=\"http", "href=\"http", "@import", "url(http"}) {
    EXPECT_THAT(html, Not(HasSubstr(part)));
  }
  EXPECT_THAT(html, HasSubstr("https://d3js.org v5"));
  EXPECT_THAT(html, HasSubstr("Redistributions in binary form"));
}

// A run that tested pairs of so many images; the first tests are edges.
PipelineResult MakeResult(ImageId num_images, std::size_t num_tested, std::size_t num_edges) {
  PipelineResult result;
  result.num_images = num_images;
  RunDetails& details = result.details.emplace();
  for (ImageId id = 1; id <= num_images; ++id) {
    details.images.push_back({id, std::to_string(id) + ".jpg", 100});
  }
  for (ImageId a = 1; a <= num_images; ++a) {
    for (ImageId b = a + 1; b <= num_images; ++b) {
      if (details.tested.size() == num_tested) return result;
      const bool is_edge = details.tested.size() < num_edges;
      details.tested.push_back({ImagePair(a, b),
                                is_edge ? PairOutcome::kEdge : PairOutcome::kNoEdge,
                                is_edge ? 20U : 0U});
    }
  }
  return result;
}

TEST(ReportData, AllPairsWithoutAnEdgeWhereThereAreFew) {
  PipelineResult result = MakeResult(4, 6, 2);
  result.details->tested[4].outcome = PairOutcome::kFailed;
  const ReportData data = MakeReportData(PipelineOptions(), result);
  ASSERT_TRUE(data.details.has_value());
  EXPECT_THAT(data.details->nonedges,
              ElementsAre(std::pair(0, 3), std::pair(1, 2), std::pair(2, 3)));
  EXPECT_EQ(data.details->num_nonedges_left_out, 0);
  const Json report = Json::parse(MakeJsonReport(data));
  EXPECT_EQ(report["nonedge_list"], Json({0, 3, 1, 2, 2, 3}));
  EXPECT_EQ(report["nonedges_left_out"], 0);
}

TEST(ReportData, AnEvenSampleOfManyPairsWithoutAnEdge) {
  constexpr std::size_t kNumNonedges = 3 * kMaxNonedges + 7;
  const PipelineResult result = MakeResult(2000, kNumNonedges + 50, 50);
  const ReportData data = MakeReportData(PipelineOptions(), result);
  ASSERT_TRUE(data.details.has_value());
  const auto& nonedges = data.details->nonedges;
  ASSERT_EQ(nonedges.size(), kMaxNonedges);
  EXPECT_EQ(data.details->num_nonedges_left_out, kNumNonedges - kMaxNonedges);
  EXPECT_EQ(data.details->edges.size(), 50);
  // Every image has a third of its pairs.
  std::vector<std::size_t> all(2000, 0);
  std::vector<std::size_t> sampled(2000, 0);
  for (std::size_t i = 50; i < result.details->tested.size(); ++i)
    ++all[result.details->tested[i].pair.id1 - 1];
  for (const auto& [a, b] : nonedges) ++sampled[a];
  for (std::size_t image = 0; image < 2000; ++image) {
    EXPECT_NEAR(static_cast<double>(sampled[image]), static_cast<double>(all[image]) / 3, 1.5);
  }
  EXPECT_TRUE(std::is_sorted(nonedges.begin(), nonedges.end()));

  const Json report = Json::parse(MakeJsonReport(data));
  EXPECT_EQ(report["nonedge_list"].size(), 2 * kMaxNonedges);
  EXPECT_EQ(report["nonedges_left_out"], kNumNonedges - kMaxNonedges);
  EXPECT_EQ(MakeReportData(PipelineOptions(), result).details->nonedges, nonedges);
}

TEST(ReportData, WithoutDetailsSumsAlone) {
  PipelineResult result = MakeResult(4, 6, 2);
  result.details.reset();
  const ReportData data = MakeReportData(PipelineOptions(), result);
  EXPECT_FALSE(data.details.has_value());
  const Json report = Json::parse(MakeJsonReport(data));
  EXPECT_FALSE(report.contains("edge_list"));
  EXPECT_EQ(report["images"]["total"], 4);
}

TEST(ReportData, NamesTheStrategyAndTheDescriptor) {
  PipelineOptions options;
  options.strategy = PipelineOptions::Strategy::kBriad;
  options.ranking.vectors.descriptor = ImageVectorOptions::Descriptor::kVlad;
  const PipelineResult result = MakeResult(4, 6, 2);
  EXPECT_EQ(MakeReportData(options, result).strategy, "briad");
  EXPECT_EQ(MakeReportData(options, result).descriptor, "vlad");
  options.ranking.ranking_path = "lists.tsv";
  EXPECT_EQ(MakeReportData(options, result).descriptor, "lists");
  options.match_list_path = "pairs.txt";
  EXPECT_EQ(MakeReportData(options, result).strategy, "list");
  EXPECT_EQ(MakeReportData(options, result).descriptor, std::nullopt);
}

TEST(ChooseThumbnails, AllWhereThereAreFew) {
  ReportDetails details;
  details.images = {{1, "a", 0}, {2, "b", 0}, {3, "c", 0}};
  EXPECT_THAT(ChooseThumbnails(details, 3),
              ElementsAre(std::pair(0, "a"), std::pair(1, "b"), std::pair(2, "c")));
}

class ChooseThumbnailsTest : public ::testing::Test {
 protected:
  // The indices of the chosen images, of 20.
  std::vector<std::size_t> Choose(std::size_t limit) const {
    std::vector<std::size_t> chosen;
    for (const auto& [image, name] : ChooseThumbnails(details_, limit)) {
      EXPECT_EQ(name, std::to_string(image));
      chosen.push_back(image);
    }
    return chosen;
  }

  ChooseThumbnailsTest() {
    for (ImageId i = 0; i < 20; ++i) details_.images.push_back({i + 1, std::to_string(i), 0});
    details_.components = {{0, 1, 2, 3, 4, 8, 9, 10}, {5, 6, 7}};
    details_.edges = {{0, 1, 20}, {1, 2, 20},  {1, 3, 20}, {3, 4, 20}, {3, 9, 20},
                      {8, 9, 20}, {2, 10, 16}, {5, 6, 20}, {6, 7, 20}};
    details_.images_without_edge = {{19, 0, {{4, 0.5, -1, 0}}}};
    details_.bridges = {{4, {4, 4}}};
    details_.articulation_points = {{8, {4, 4}}};
    details_.weak_links = {{{4, 4}, {6}}};
  }

  ReportDetails details_;
};

TEST_F(ChooseThumbnailsTest, WhatTheListsShowComesFirst) {
  EXPECT_THAT(Choose(2), ElementsAre(4, 19));
  EXPECT_THAT(Choose(5), ElementsAre(3, 4, 8, 9, 19));
  EXPECT_THAT(Choose(7), ElementsAre(2, 3, 4, 8, 9, 10, 19));
}

TEST_F(ChooseThumbnailsTest, ThenTheBestConnectedOfEachComponent) {
  // 1 and 3 have three neighbours each, 6 has two.
  EXPECT_THAT(Choose(9), ElementsAre(1, 2, 3, 4, 6, 8, 9, 10, 19));
  // What is in no component and in no list has no place on the page.
  EXPECT_THAT(Choose(19), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 19));
}

class ThumbnailsTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(directory_.Path() / name, std::ios::binary) << bytes;
  }

  // A picture that is dark on the left and bright on the right.
  static std::string Jpeg(int width, int height) {
    cv::Mat image(height, width, CV_8UC3, cv::Scalar(20, 20, 20));
    image.colRange(width / 2, width) = cv::Scalar(230, 230, 230);
    std::vector<unsigned char> bytes;
    cv::imencode(".jpg", image, bytes);
    return {bytes.begin(), bytes.end()};
  }

  std::map<std::size_t, std::string> Make(const Images& images, int num_threads = 2) const {
    ThreadPool threads(num_threads);
    return MakeThumbnails(directory_.Path(), images, threads, stop_);
  }

  static cv::Mat Decode(const std::string& jpeg) {
    return cv::imdecode(std::vector<unsigned char>(jpeg.begin(), jpeg.end()), cv::IMREAD_COLOR);
  }

  StopRequest stop_;
  TestDirectory directory_;
};

TEST_F(ThumbnailsTest, LongestSide) {
  std::filesystem::create_directory(directory_.Path() / "below");
  Write("large.jpg", Jpeg(1600, 400));
  Write("below/tall \xc3\xbc.jpg", Jpeg(300, 900));
  Write("small.jpg", Jpeg(40, 20));
  Write("line.jpg", Jpeg(3000, 2));
  const auto thumbnails =
      Make({{0, "large.jpg"}, {3, "below/tall \xc3\xbc.jpg"}, {4, "small.jpg"}, {5, "line.jpg"}});
  ASSERT_EQ(thumbnails.size(), 4);
  EXPECT_EQ(Decode(thumbnails.at(0)).size(), cv::Size(128, 32));
  EXPECT_EQ(Decode(thumbnails.at(3)).size(), cv::Size(43, 128));
  EXPECT_EQ(Decode(thumbnails.at(4)).size(), cv::Size(40, 20));
  EXPECT_EQ(Decode(thumbnails.at(5)).size(), cv::Size(128, 1));
  const cv::Mat large = Decode(thumbnails.at(0));
  EXPECT_LT(large.at<cv::Vec3b>(16, 10)[1], 60);
  EXPECT_GT(large.at<cv::Vec3b>(16, 118)[1], 190);
}

TEST_F(ThumbnailsTest, TheOrientationThatTheCameraNoted) {
  // Exif: one entry, orientation (0x0112) 6, to be turned by 90 degrees clockwise.
  const std::string tiff = std::string("MM\0*\0\0\0\x08", 8) + std::string("\0\x01", 2) +
                           std::string("\x01\x12\0\x03\0\0\0\x01\0\x06\0\0", 12) +
                           std::string("\0\0\0\0", 4);
  const std::string exif = std::string("Exif\0\0", 6) + tiff;
  const std::string segment =
      "\xff\xe1" + std::string({'\0', static_cast<char>(exif.size() + 2)}) + exif;
  for (const int width : {256, 1600}) {
    const std::string jpeg = Jpeg(width, width / 4);
    Write("turned.jpg", jpeg.substr(0, 2) + segment + jpeg.substr(2));
    const cv::Mat turned = Decode(Make({{0, "turned.jpg"}}).at(0));
    ASSERT_EQ(turned.size(), cv::Size(32, 128));
    EXPECT_LT(turned.at<cv::Vec3b>(10, 16)[1], 60);
    EXPECT_GT(turned.at<cv::Vec3b>(118, 16)[1], 190);
  }
}

TEST_F(ThumbnailsTest, WhatCannotBeReadIsLeftOut) {
  Write("good.jpg", Jpeg(200, 200));
  Write("text.jpg", "This is no photo.");
  Write("empty.jpg", "");
  std::filesystem::create_directory(directory_.Path() / "directory.jpg");
  const Images images = {{0, "missing.jpg"}, {1, "text.jpg"},      {2, "empty.jpg"},
                         {3, "good.jpg"},    {4, "directory.jpg"}, {5, ""}};
  const auto thumbnails = Make(images);
  ASSERT_EQ(thumbnails.size(), 1);
  EXPECT_EQ(thumbnails.begin()->first, 3);
  EXPECT_EQ(Make(images, 1), thumbnails);
}

}  // namespace
}  // namespace colmap_graphmatch
