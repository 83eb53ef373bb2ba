#include "src/apps/map_report.h"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/example_map.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_store.h"

namespace visual_localization::apps {
namespace {

using testing::HasSubstr;
using testing::Not;

/// What is said of 20 images with these ambiguous places.
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
  EXPECT_THAT(reportOf(places), HasSubstr("of this large map one image in 3 was compared, with one in 3\n"));
}

}  // namespace
}  // namespace visual_localization::apps
