#include "apps/report_page.h"

#include <cmath>
#include <limits>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/drive_report.h"
#include "test/support/example_map.h"

namespace visual_localization::apps {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

const char* const kHostile = "</script><script>alert(1)</script>\xE2\x80\xA8 \xFF";

/// What a browser takes for the content of the element "data".
json dataOf(const std::string& page) {
  const std::string opening = R"(<script id="data" type="application/json">)";
  const std::size_t begin = page.find(opening) + opening.size();
  return json::parse(page.substr(begin, page.find("</script", begin) - begin));
}

std::shared_ptr<const TrainingMap> hostileMap(std::size_t images) {
  MapHeader header = test::exampleHeader();
  header.sessions[0].name = kHostile;
  return std::make_shared<const TrainingMap>(header, test::exampleImages(images));
}

TEST(PagePictures, AreBase64) {
  PagePictures pictures(100);
  pictures.add(0, {'a'});
  pictures.add(1, {'a', 'b'});
  pictures.add(2, {'a', 'b', 'c', 255});
  pictures.add(3, {});
  EXPECT_EQ(pictures.toJson(), json::parse(R"({"stride": 1, "jpeg": {"0": "YQ==", "1": "YWI=", "2": "YWJj/w=="}})"));
}

TEST(PagePictures, AreFewerWhenTheyTakeTooMuch) {
  PagePictures pictures(100);
  for (std::size_t i = 0; i < 100; ++i) {
    if (pictures.wants(i)) pictures.add(i, std::vector<std::uint8_t>(10));
  }
  const json kept = pictures.toJson();
  EXPECT_EQ(kept.at("stride"), 16);
  EXPECT_EQ(kept.at("jpeg").size(), 7U);
  EXPECT_TRUE(kept.at("jpeg").contains("96"));
}

TEST(ReportPage, HoldsNamesThatCannotEndItsScript) {
  const auto map = hostileMap(8);
  const std::string page = reportPage({{"map", pageMap(kHostile, *map)}});
  EXPECT_THAT(page, Not(HasSubstr("alert(1)</script>")));
  EXPECT_THAT(page, Not(HasSubstr("\xE2\x80\xA8")));
  const json shown = dataOf(page).at("map");
  EXPECT_EQ(shown.at("path"), "</script><script>alert(1)</script>\xE2\x80\xA8 \xEF\xBF\xBD");
  EXPECT_EQ(shown.at("sessions").at(0), shown.at("path"));
}

TEST(ReportPage, NeedsNothingElse) {
  const std::string page = reportPage({{"map", pageMap("x.map", *hostileMap(8))}});
  EXPECT_THAT(page, HasSubstr("Permission is hereby granted, free of charge"));
  for (const char* outside : {"src=\"", "href=\"", "@import", "url(", "fetch(", "@PAGE_JS@"}) {
    EXPECT_THAT(page, Not(HasSubstr(outside)));
  }
}

TEST(ReportPage, HasTheTrainingImagesOfTheMap) {
  const auto map = hostileMap(8);
  json shown = pageMap("x.map", *map);
  EXPECT_EQ(shown.at("size"), 8);
  ASSERT_EQ(shown.at("east").size(), 8U);
  EXPECT_NEAR(shown.at("north").at(5).get<double>(), map->position_m(5).y(), 0.005);
  EXPECT_EQ(shown.at("session"), json::parse("[0, 0, 0, 0, 1, 1, 1, 1]"));
  EXPECT_FALSE(shown.at("landmarks").empty());
}

TEST(ReportPage, HasEveryFigureOfADrive) {
  const auto map = hostileMap(8);
  const Localizer localizer(map, {});
  DriveReport report(kHostile, "/image");
  Estimate estimate;
  estimate.stamp_ns = 1'000'000'000'000;
  estimate.pose.position_m = {1.5, -2.25};
  estimate.pose.covariance_m2 = 4.0 * Eigen::Matrix2d::Identity();
  const cv::Mat grey(480, 640, CV_8U, cv::Scalar(90));
  report.add(estimate, localizer, grey, Eigen::Vector2d(1.0, 2.0));
  estimate.stamp_ns += 500'000'000;
  estimate.state = LocalizationState::kTracking;
  estimate.evidence.probability = 0.97;
  estimate.tracked.best_image = 3;
  estimate.tracked.best.matches = 42;
  report.add(estimate, localizer, grey, std::nullopt);

  const json drive = dataOf(report.page("x.map", *map)).at("drive");
  EXPECT_EQ(drive.at("start_s"), 1000.0);
  EXPECT_EQ(drive.at("t"), json::parse("[0.0, 0.5]"));
  EXPECT_EQ(drive.at("east"), json::parse("[1.5, 1.5]"));
  EXPECT_EQ(drive.at("true_north"), json::parse("[2.0, null]"));
  EXPECT_EQ(drive.at("state"), json::parse(R"(["INITIALIZING", "TRACKING"])"));
  EXPECT_EQ(drive.at("sigma"), json::parse("[2.0, 2.0]"));
  EXPECT_EQ(drive.at("probability"), json::parse("[null, 0.97]"));
  EXPECT_EQ(drive.at("matches").at(1), 42);
  EXPECT_EQ(drive.at("best"), json::parse("[0, 3]"));
  EXPECT_EQ(drive.at("images").at("jpeg").size(), 2U);
}

}  // namespace
}  // namespace visual_localization::apps
