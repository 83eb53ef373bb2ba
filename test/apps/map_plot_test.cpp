#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/map_export.h"
#include "test/support/example_map.h"
#include "test/support/temporary_folder.h"

namespace visual_localization::apps {
namespace {

using nlohmann::json;

const LocalFrame kFrame({48.5, 9.0, 0.0});

/// A metre and a second a fix, due north.
Fix fixAt(int second) {
  Fix fix;
  fix.has_fix = true;
  fix.stamp_ns = second * 1'000'000'000LL;
  fix.position = kFrame.toGeodetic({0.0, static_cast<double>(second)});
  return fix;
}

PlottedSession sessionOf(const std::vector<Fix>& fixes) {
  return {"monday", fixes, cleanTrajectory(fixes, kFrame, {}), {{0.5, 1.25}, {0.5, 2.25}}, {{3.5, 4.5}}};
}

std::vector<Fix> fixesUntil(int seconds) {
  std::vector<Fix> fixes;
  for (int second = 0; second <= seconds; ++second) fixes.push_back(fixAt(second));
  return fixes;
}

json drawn(const PlottedSession& session) { return json::parse(mapPlotJson({session}, kFrame)).at("sessions").at(0); }

void expectNear(const json& position_m, double east_m, double north_m, double tolerance_m) {
  EXPECT_NEAR(position_m.at(0).get<double>(), east_m, tolerance_m);
  EXPECT_NEAR(position_m.at(1).get<double>(), north_m, tolerance_m);
}

TEST(MapPlot, DescribesASession) {
  const PlottedSession session = sessionOf(fixesUntil(20));
  const json shown = drawn(session);
  EXPECT_EQ(shown.at("name"), "monday");
  EXPECT_EQ(shown.at("images_m"), json::parse("[[0.5, 1.25], [0.5, 2.25]]"));
  EXPECT_EQ(shown.at("landmarks_m"), json::parse("[[3.5, 4.5]]"));
  EXPECT_DOUBLE_EQ(shown.at("length_m").get<double>(), session.cleaned.trajectory.length());
  EXPECT_EQ(shown.at("gaps_closed"), 0);
  ASSERT_EQ(shown.at("paths_m").size(), 1U);
  EXPECT_EQ(shown.at("paths_m").at(0).size(), session.cleaned.trajectory.points().size());
  expectNear(shown.at("paths_m").at(0).back(), 0.0, 20.0, 0.5);
}

TEST(MapPlot, SortsFixesByVerdict) {
  PlottedSession session = sessionOf(fixesUntil(30));
  session.fixes[10].position = kFrame.toGeodetic({40.0, 10.0});
  session.cleaned.verdicts[10] = FixVerdict::kSpike;
  session.cleaned.verdicts[20] = FixVerdict::kDisordered;
  const json shown = drawn(session).at("fixes");
  ASSERT_EQ(shown.size(), 5U);
  EXPECT_EQ(shown.at("kept").at("count"), 29);
  EXPECT_EQ(shown.at("kept").at("positions_m").size(), 29U);
  ASSERT_EQ(shown.at("spike").at("count"), 1);
  expectNear(shown.at("spike").at("positions_m").at(0), 40.0, 10.0, 1e-6);
  ASSERT_EQ(shown.at("out of order").at("count"), 1);
  expectNear(shown.at("out of order").at("positions_m").at(0), 0.0, 20.0, 1e-6);
  EXPECT_EQ(shown.at("multipath").at("count"), 0);
  EXPECT_TRUE(shown.at("multipath").at("positions_m").empty());
}

TEST(MapPlot, AFixWithoutCoordinatesLiesOnThePathOrNowhere) {
  std::vector<Fix> fixes = fixesUntil(30);
  for (const std::size_t i : {0U, 15U}) {
    fixes[i].has_fix = false;
    fixes[i].position.latitude_deg = std::nan("");
  }
  const json shown = drawn(sessionOf(fixes)).at("fixes").at("no fix");
  EXPECT_EQ(shown.at("count"), 2);
  ASSERT_EQ(shown.at("positions_m").size(), 1U) << "the other one is before the path begins";
  expectNear(shown.at("positions_m").at(0), 0.0, 15.0, 0.5);
}

TEST(MapPlot, APathThatIsLeftOpenHasSeveralParts) {
  std::vector<TrajectoryPoint> points;
  for (const int second : {0, 1, 2, 30, 31}) {
    points.push_back({second * 1'000'000'000LL, {0.0, static_cast<double>(second)}, 0.0});
  }
  PlottedSession session = sessionOf(fixesUntil(31));
  session.cleaned.trajectory = Trajectory(points, 28.0);
  EXPECT_EQ(drawn(session).at("paths_m"), json::parse("[[[0, 0], [0, 1], [0, 2], [0, 30], [0, 31]]]"));
  session.cleaned.trajectory = Trajectory(points, 5.0);
  EXPECT_EQ(drawn(session).at("paths_m"), json::parse("[[[0, 0], [0, 1], [0, 2]], [[0, 30], [0, 31]]]"));
}

TEST(MapPlot, TakesImagesAndLandmarksOfEachSessionFromTheMap) {
  std::vector<PlottedSession> sessions(2);
  const TrainingMap map(test::exampleHeader(), test::exampleImages(6));
  addMap(map, sessions);
  ASSERT_EQ(sessions[0].images_m.size(), 3U);
  ASSERT_EQ(sessions[1].images_m.size(), 3U);
  EXPECT_EQ(sessions[1].images_m[0], map.position_m(3));
  EXPECT_EQ(sessions[0].landmarks_m.size(), 20U) << "of two images, ten each";
  const ImageGeometry& geometry = *map.geometry(4);
  EXPECT_EQ(sessions[1].landmarks_m[0],
            Eigen::Vector2d((geometry.camera.position_m + geometry.landmarks[0].offset_m.cast<double>()).head<2>()));
}

TEST(MapPlot, RepairsNamesThatAreNotUtf8) {
  PlottedSession session = sessionOf(fixesUntil(20));
  session.name = "T\xC3\xBC\xE2\x82\xAC \xBC \"<\n";
  EXPECT_EQ(drawn(session).at("name"), "T\xC3\xBC\xE2\x82\xAC \xEF\xBF\xBD \"<\n");
}

TEST(MapPlot, AFailureLeavesTheOldPlotAndNothingElse) {
  const test::TemporaryFolder folder;
  test::writeAll(folder / "plot.png", "old");
  try {
    drawMapPlot(folder / "plot.png", {sessionOf(fixesUntil(20))}, kFrame);
    FAIL() << "there is no script beside this program";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("plot_map.py: is missing"), std::string::npos) << error.what();
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"plot.png"});
  EXPECT_EQ(test::readAll(folder / "plot.png"), "old");
}

}  // namespace
}  // namespace visual_localization::apps
