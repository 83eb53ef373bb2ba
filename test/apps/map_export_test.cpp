#include "apps/map_export.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/support/example_map.h"

namespace visual_localization::apps {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TrainingMap mapOf(const std::vector<std::string>& sessions) {
  MapHeader header = test::exampleHeader();
  header.sessions.clear();
  for (const std::string& name : sessions) header.sessions.push_back({name});
  return TrainingMap(header, test::exampleImages(20));
}

MapFindings findingsOf(const TrainingMap& map) {
  MapFindings findings;
  findings.config.few_features = 10;  // the first image has none
  findings.survey = survey(map, findings.config);
  return findings;
}

std::string toGeoJson(const TrainingMap& map, const MapFindings& findings) {
  std::string all;
  writeGeoJson(map, findings, [&all](const std::string& text) { all += text; });
  return all;
}

std::string toCsv(const TrainingMap& map, const MapFindings& findings) {
  std::string all;
  writeCsv(map, findings, [&all](const std::string& text) { all += text; });
  return all;
}

std::vector<json> featuresOf(const json& collection, const std::string& geometry, const std::string& property,
                             const json& value) {
  std::vector<json> found;
  for (const json& feature : collection.at("features")) {
    const json& properties = feature.at("properties");
    const bool wanted = properties.count(property) != 0 && properties.at(property) == value;
    if (wanted && feature.at("geometry").at("type") == geometry) found.push_back(feature);
  }
  return found;
}

TEST(MapExport, GeoJsonHasAPathForEachSessionAndAPointForEachImage) {
  const TrainingMap map = mapOf({"monday", "tuesday"});
  const json collection = json::parse(toGeoJson(map, findingsOf(map)));
  EXPECT_EQ(collection.at("type"), "FeatureCollection");
  for (const std::string session : {"monday", "tuesday"}) {
    EXPECT_EQ(featuresOf(collection, "Point", "session", session).size(), 10U);
    const auto paths = featuresOf(collection, "LineString", "session", session);
    ASSERT_FALSE(paths.empty());
    EXPECT_EQ(paths.front().at("geometry").at("coordinates").size(), 10U);
    EXPECT_EQ(paths.front().at("properties").at("images"), 10);
  }
}

TEST(MapExport, GeoJsonNumbersHaveTheirDigits) {
  const TrainingMap map = mapOf({"monday", "tuesday"});
  const json point = featuresOf(json::parse(toGeoJson(map, findingsOf(map))), "Point", "image", 7).at(0);
  const GeodeticPoint position = map.frame().toGeodetic(map.position_m(7));
  const json& coordinates = point.at("geometry").at("coordinates");
  EXPECT_NEAR(coordinates.at(0).get<double>(), position.longitude_deg, 5e-12) << "longitude first";
  EXPECT_NEAR(coordinates.at(1).get<double>(), position.latitude_deg, 5e-11);
  EXPECT_LE(coordinates.at(0).dump().size(), 13U);
  EXPECT_EQ(point.at("properties").at("stamp"), "1221210008.000000049");
  EXPECT_EQ(point.at("properties").at("yaw_rad").dump(), "0.366667");
  EXPECT_EQ(point.at("properties").at("features"), 20);
  EXPECT_EQ(point.at("properties").at("few_features"), false);
}

TEST(MapExport, AWeakStretchOfOneImageIsALineOfTwoPoints) {
  const TrainingMap map = mapOf({"monday", "tuesday"});
  const auto weak = featuresOf(json::parse(toGeoJson(map, findingsOf(map))), "LineString", "weak", "few features");
  ASSERT_EQ(weak.size(), 1U);
  EXPECT_EQ(weak[0].at("properties").at("images"), 1);
  EXPECT_EQ(weak[0].at("properties").at("least_features"), 0);
  const json& coordinates = weak[0].at("geometry").at("coordinates");
  ASSERT_EQ(coordinates.size(), 2U);
  EXPECT_EQ(coordinates.at(0), coordinates.at(1));
}

TEST(MapExport, AmbiguityIsExportedOnlyIfItWasChecked) {
  const TrainingMap map = mapOf({"monday", "tuesday"});
  MapFindings findings = findingsOf(map);
  const json unchecked = featuresOf(json::parse(toGeoJson(map, findings)), "Point", "image", 7).at(0);
  EXPECT_EQ(unchecked.at("properties").count("ambiguous"), 0U);
  EXPECT_THAT(toCsv(map, findings), HasSubstr(",20,0,\n"));
  findings.ambiguity.emplace();
  findings.ambiguity->images = {{7, 1, 0.5, 0.25}};
  const json collection = json::parse(toGeoJson(map, findings));
  EXPECT_EQ(featuresOf(collection, "Point", "ambiguous", true).size(), 1U);
  EXPECT_EQ(featuresOf(collection, "Point", "ambiguous", false).size(), 19U);
  EXPECT_THAT(toCsv(map, findings), HasSubstr(",20,0,1\n"));
}

TEST(MapExport, NamesOfSessionsAreQuotedAndRepaired) {
  const std::string odd = "a\"b\\c\n\x1b \xC3\xA4\xC2\x9B\xE2\x80\xAE";  // then U+009B and U+202E
  const TrainingMap map = mapOf({odd, "T\xBC\xE2\x82"});
  const std::string text = toGeoJson(map, findingsOf(map));
  const json collection = json::parse(text);
  EXPECT_EQ(featuresOf(collection, "Point", "session", "a\"b\\c   \xC3\xA4 ?").size(), 10U);
  EXPECT_EQ(featuresOf(collection, "Point", "session", "T???").size(), 10U);
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')), collection.at("features").size() + 2)
      << "one feature a line";
  EXPECT_THAT(toCsv(map, findingsOf(map)), HasSubstr(",\"a\"\"b\\c   \xC3\xA4 ?\","));
  EXPECT_THAT(toCsv(map, findingsOf(map)), HasSubstr(",\"T???\","));
}

TEST(MapExport, NoPieceIsLongerThanOneImageNeeds) {
  const std::string longest(1000, 'n');  // bytes that the name of a session may have
  const TrainingMap map = mapOf({longest, "tuesday"});
  const MapFindings findings = findingsOf(map);
  std::size_t most = 0;
  const auto measure = [&most](const std::string& text) { most = std::max(most, text.size()); };
  writeGeoJson(map, findings, measure);
  EXPECT_LT(most, longest.size() + 500);
  most = 0;
  writeCsv(map, findings, measure);
  EXPECT_LT(most, longest.size() + 500);
}

}  // namespace
}  // namespace visual_localization::apps
