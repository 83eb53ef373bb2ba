#include "apps/region.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/refusal.h"

namespace visual_localization::apps {
namespace {

using testing::HasSubstr;

const char* const kSquare = R"([[9.0, 48.0], [9.1, 48.0], [9.1, 48.1], [9.0, 48.1], [9.0, 48.0]])";

std::string polygon(const std::string& rings) { return R"({"type": "Polygon", "coordinates": [)" + rings + "]}"; }

std::string refusal(const std::string& text) {
  return test::refusalOf<RegionError>([&] { const Region region(text); });
}

TEST(Region, HasWhatIsInsideAndOnTheBorder) {
  const Region region(polygon(kSquare));
  EXPECT_TRUE(region.contains({48.05, 9.05, 0.0}));
  EXPECT_TRUE(region.contains({48.0, 9.05, 0.0}));
  EXPECT_FALSE(region.contains({48.05, 9.2, 0.0}));
  EXPECT_FALSE(region.contains({9.05, 48.05, 0.0}));
}

TEST(Region, HasHoles) {
  const std::string hole = "[[9.04, 48.04], [9.04, 48.06], [9.06, 48.06], [9.06, 48.04], [9.04, 48.04]]";
  const Region region(polygon(std::string(kSquare) + ", " + hole));
  EXPECT_FALSE(region.contains({48.05, 9.05, 0.0}));
  EXPECT_TRUE(region.contains({48.02, 9.05, 0.0}));
}

TEST(Region, MayBeACollectionWithOtherThings) {
  const Region region(R"({"type": "FeatureCollection", "features": [
      {"type": "Feature", "properties": {"name": "gate"}, "geometry": {"type": "Point", "coordinates": [1, 2]}},
      {"type": "Feature", "properties": {}, "geometry": null},
      {"type": "Feature", "properties": {}, "geometry": {"type": "MultiPolygon", "coordinates": [[)" +
                      std::string(kSquare) + "]]}}]}");
  EXPECT_TRUE(region.contains({48.05, 9.05, 0.0}));
}

TEST(Region, MayBeInMetresOfTheMap) {
  const LocalFrame frame({48.5, 9.05, 0.0});
  const std::string square = polygon("[[-10, 0], [200, 0], [200, 100], [-10, 100], [-10, 0]]");
  const Region region(square, RegionFrame::kMap);
  EXPECT_TRUE(region.contains({199.0, 50.0}, frame));
  EXPECT_FALSE(region.contains({50.0, -1.0}, frame));
  EXPECT_TRUE(Region(polygon(kSquare)).contains({0.0, 0.0}, LocalFrame({48.05, 9.05, 0.0})));
  EXPECT_THAT(refusal(square), HasSubstr("longitude in [-180, 180]"));
  const auto inMetres = [](const std::string& text) {
    return test::refusalOf<RegionError>([&] { const Region refused(text, RegionFrame::kMap); });
  };
  EXPECT_THAT(inMetres(polygon(R"([["9", 48], [9.1, 48], [9.1, 48.1], ["9", 48]])")), HasSubstr("[east, north]"));
  EXPECT_THAT(inMetres(polygon("[[0, 2e7], [9, 0], [9, 1], [0, 2e7]]")), HasSubstr("[-10000000, 10000000] metres"));
}

TEST(Region, RefusesWhatIsNoArea) {
  EXPECT_THAT(refusal(""), HasSubstr("no JSON"));
  EXPECT_THAT(refusal("[1, 2]"), HasSubstr("an object was expected"));
  EXPECT_THAT(refusal("{}"), HasSubstr("'type' is missing"));
  EXPECT_THAT(refusal(R"({"type": "Point", "coordinates": [1, 2]})"), HasSubstr("no Polygon"));
  EXPECT_THAT(refusal(R"({"type": "FeatureCollection", "features": 3})"), HasSubstr("'features' must be a list"));
  EXPECT_THAT(refusal(R"({"type": "Polygon"})"), HasSubstr("'coordinates' is missing"));
  EXPECT_THAT(refusal(R"({"type": "Polygon", "coordinates": []})"), HasSubstr("must have a ring"));
  EXPECT_THAT(refusal(polygon("[[9, 48], [9.1, 48], [9, 48]]")), HasSubstr("at least 4"));
  EXPECT_THAT(refusal(polygon("[[9, 48], [9.1, 48], [9.1, 48.1], [9, 48.1]]")), HasSubstr("the last one as the first"));
  EXPECT_THAT(refusal(polygon(R"([["9", 48], [9.1, 48], [9.1, 48.1], ["9", 48]])")), HasSubstr("longitude, latitude"));
  EXPECT_THAT(refusal(polygon("[[48, 99], [48, 99.1], [48.1, 99], [48, 99]]")), HasSubstr("latitude in [-90, 90]"));
  EXPECT_THAT(refusal(polygon("[[9, 48], [9.1, 48.1], [9.1, 48], [9, 48.1], [9, 48]]")), HasSubstr("not simple"));
}

TEST(Region, RefusesDeepNesting) {
  EXPECT_THAT(refusal(std::string(100000, '[')), HasSubstr("nested"));
  std::string deep = R"({"type": "GeometryCollection", "geometries": [)";
  std::string text;
  for (int i = 0; i < 1000; ++i) text += deep;
  EXPECT_THAT(refusal(text), HasSubstr("nested"));
}

}  // namespace
}  // namespace visual_localization::apps
