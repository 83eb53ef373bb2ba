#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/map_export.h"
#include "test/support/example_map.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::apps {
namespace {

using testing::HasSubstr;
using testing::Not;

/// What is said of 20 images with these findings.
std::string reportOf(const AmbiguousPlaces& places) {
  const test::TemporaryFolder folder;
  const TrainingMap map(test::exampleHeader(), test::exampleImages(20));
  const std::string path = folder / "a.map";
  saveMap(map, path);
  MapFindings findings;
  findings.survey = survey(map, findings.config);
  findings.ambiguity = places;
  std::ostringstream text;
  printMapReport(text, path, map, findings);
  return text.str();
}

/// The line about landmarks of 20 images of which 13 have 10 each, when so many images are looked at.
std::string landmarksOf(std::size_t most_images, bool any = true) {
  const test::TemporaryFolder folder;
  std::vector<TrainingImage> images = test::exampleImages(20);
  for (TrainingImage& image : images) {
    if (!any) image.geometry.reset();
    if (!image.geometry) continue;
    std::uint32_t id = 0;
    for (SeenLandmark& landmark : image.geometry->landmarks) landmark.id = 100 + id++;
  }
  const TrainingMap map(test::exampleHeader(), images);
  const std::string path = folder / "a.map";
  saveMap(map, path);
  MapFindings findings;
  findings.survey = survey(map, findings.config);
  findings.landmarks = landmarkSurvey(map, most_images);
  std::ostringstream text;
  printMapReport(text, path, map, findings);
  const std::size_t begin = text.str().find("landmarks:");
  return text.str().substr(begin, text.str().find('\n', begin) - begin);
}

TEST(MapReport, CountsLandmarks) {
  EXPECT_EQ(landmarksOf(20), "landmarks:   in 13 of 20 images (65 %), 10 different ones, per image median 10; 4.4 kB");
  EXPECT_EQ(landmarksOf(5),
            "landmarks:   in 13 of 20 images (65 %), per image median 10; 1.0 kB in the 3 images looked "
            "at (--check: all)");
  EXPECT_THAT(landmarksOf(20, false), HasSubstr("landmarks:   none"));
}

/// Of the first session, which has images 0 to 9.
Stretch stretch(std::size_t first, std::size_t last) { return {0, first, last, last - first + 1, 1.0, 20, 0}; }

TEST(MapReport, SaysHowManyImagesCannotBeJudged) {
  AmbiguousPlaces places;
  EXPECT_THAT(reportOf(places), Not(HasSubstr("judged")));
  places.unjudged = 1;
  EXPECT_THAT(reportOf(places), HasSubstr(" 1 image has no neighbour within 5 m and cannot be judged\n"));
  places.unjudged = 25;
  EXPECT_THAT(reportOf(places), HasSubstr(" 25 images have no neighbour within 5 m and cannot be judged\n"));
}

TEST(MapReport, SaysOfWhichShareOfALargeMapItSpeaks) {
  AmbiguousPlaces places;
  EXPECT_THAT(reportOf(places), Not(HasSubstr("large map")));
  places.stride = 3;
  EXPECT_THAT(reportOf(places), HasSubstr("large map: one image in 3 was compared with one in 3\n"));
}

TEST(MapReport, NamesTheTwinOfAStretch) {
  AmbiguousPlaces places;
  places.images = {{4, 1, 0.5, 0.25}};
  places.stretches = {stretch(3, 6)};
  EXPECT_THAT(reportOf(places), HasSubstr("4 images; similarity 0.50 to (49.8, 3.0), 0.25 to the neighbours\n"));
}

TEST(MapReport, AStretchThatWasNotComparedHasNoTwin) {
  AmbiguousPlaces places;
  places.images = {{8, 1, 0.5, 0.25}};
  places.stretches = {stretch(3, 6)};
  EXPECT_THAT(reportOf(places), HasSubstr("4 images\n")) << "image 8 is beyond it";
  places.images = {{11, 1, 0.5, 0.25}};
  places.stretches = {stretch(3, 12)};
  EXPECT_THAT(reportOf(places), HasSubstr("10 images\n")) << "image 11 is of another session";
}

TEST(MapReport, NamesStretchesByTheirErrorAndThoseThatAreDoubtful) {
  const test::TemporaryFolder folder;
  MapHeader header = test::exampleHeader();
  header.sessions[0].fixes = FixBudget{0.3, false, 0.2, 10.0, 100.0, 0.2};
  header.sessions[0].doubtful = {{1'000'000'000, 61'500'000'000, 0.0, 40.0, 3.0, 12.0, 8.0}};
  const TrainingMap map(header, test::exampleImages(20));
  const std::string path = folder / "a.map";
  saveMap(map, path);
  MapFindings findings;
  findings.survey = survey(map, findings.config);
  findings.errors = {{0, 0.0, 40.0, 1.0, 3.0}, {0, 40.0, 90.0, 0.2, 0.2}};
  std::ostringstream text;
  printMapReport(text, path, map, findings);
  EXPECT_THAT(text.str(), HasSubstr("0 m to     40 m: 3.00 m\n"));
  EXPECT_THAT(text.str(), HasSubstr("40 m to     90 m: 0.20 m\n"));
  EXPECT_THAT(text.str(), HasSubstr("check before use: 0 to 40 m (1.0 to 61.5 s): 3.0 m off per axis"));
  EXPECT_THAT(text.str(), HasSubstr("; by the turns of the images 8.0 m, by the fixes 12.0 m\n"));
}

TEST(MapReport, SaysWhichCameraEachSessionHas) {
  const std::string report = reportOf(AmbiguousPlaces());
  EXPECT_THAT(report,
              HasSubstr("cameras:     0: 320 x 240 px, focal length 266.3 x 266.5 px, plumb_bob; mask uses 83 % of "
                        "the image\n             1: no calibration: places only\n"));
}

}  // namespace
}  // namespace visual_localization::apps
