#include "apps/map_export.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/app_support.h"
#include "base/text.h"
#include "base/time.h"
#include "survey/map_survey.h"

namespace visual_localization::apps {
namespace {

using nlohmann::json;

std::string sessionOf(const TrainingMap& map, int session) {
  const std::string& name = map.header().sessions[static_cast<std::size_t>(session)].name;
  return oneLine(name, name.size());
}

/// With this many significant digits: more would only pretend.
double rounded(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return std::strtod(text.data(), nullptr);
}

double rounded(double value) { return rounded(value, 6); }

/// Empty when that was not checked.
std::vector<bool> ambiguousImages(const TrainingMap& map, const MapFindings& findings) {
  std::vector<bool> ambiguous(findings.ambiguity ? map.size() : 0, false);
  if (!findings.ambiguity) return ambiguous;
  for (const AmbiguousImage& image : findings.ambiguity->images) ambiguous[image.image] = true;
  return ambiguous;
}

/// GeoJSON order: longitude first.
json coordinates(const TrainingMap& map, std::size_t i) {
  const GeodeticPoint point = map.frame().toGeodetic(map.position_m(i));
  return {rounded(point.longitude_deg, 12), rounded(point.latitude_deg, 12)};
}

json feature(const std::string& type, json where, json properties) {
  return {{"type", "Feature"},
          {"geometry", {{"type", type}, {"coordinates", std::move(where)}}},
          {"properties", std::move(properties)}};
}

/// Images of each session, in the order of the map.
using SessionImages = std::vector<std::vector<std::size_t>>;

SessionImages imagesOfSessions(const TrainingMap& map) {
  SessionImages images(map.header().sessions.size());
  for (std::size_t i = 0; i < map.size(); ++i) images[static_cast<std::size_t>(map.pose(i).session)].push_back(i);
  return images;
}

/// One feature a line, each written before the next one is made: a map may have very many images.
class FeatureCollection {
 public:
  FeatureCollection(const TrainingMap& map, const TextSink& write) : map_(map), write_(write) {
    write_("{\"type\":\"FeatureCollection\",\"features\":[\n");
  }

  void addPoint(std::size_t image, json properties) {
    begin();
    write_(feature("Point", coordinates(map_, image), std::move(properties)).dump());
  }

  /// Through images from `first` to `last`, neither of them the end.
  template <class Image>
  void addLine(Image first, Image last, json properties) {
    begin();
    write_("{\"geometry\":{\"coordinates\":[" + coordinates(map_, *first).dump());
    Image image = first;
    do {  // GeoJSON's line has at least two positions
      if (image != last) ++image;
      write_("," + coordinates(map_, *image).dump());
    } while (image != last);
    write_("],\"type\":\"LineString\"},\"properties\":" + properties.dump() + ",\"type\":\"Feature\"}");
  }

  void end() { write_("\n]}\n"); }

 private:
  void begin() {
    if (!first_) write_(",\n");
    first_ = false;
  }

  const TrainingMap& map_;
  const TextSink& write_;
  bool first_ = true;
};

void addPaths(const TrainingMap& map, const SessionImages& images, FeatureCollection& features) {
  for (std::size_t s = 0; s < images.size(); ++s) {
    if (images[s].empty()) continue;
    features.addLine(images[s].begin(), images[s].end() - 1,
                     {{"session", sessionOf(map, static_cast<int>(s))}, {"images", images[s].size()}});
  }
}

void addStretches(const TrainingMap& map, const SessionImages& images, const std::vector<Stretch>& stretches,
                  const std::string& flaw, FeatureCollection& features) {
  for (const Stretch& stretch : stretches) {
    const std::vector<std::size_t>& session = images[static_cast<std::size_t>(stretch.session)];
    features.addLine(std::lower_bound(session.begin(), session.end(), stretch.first),
                     std::lower_bound(session.begin(), session.end(), stretch.last),
                     {{"weak", flaw},
                      {"session", sessionOf(map, stretch.session)},
                      {"images", stretch.images},
                      {"length_m", rounded(stretch.length_m)},
                      {"least_features", stretch.least_features}});
  }
}

void addGaps(const TrainingMap& map, const MapFindings& findings, FeatureCollection& features) {
  for (const Step& step : findings.survey.longest_steps) {
    if (step.length_m <= findings.config.gap_m) continue;
    const std::array<std::size_t, 2> ends{step.from, step.to};
    features.addLine(
        ends.begin(), ends.end() - 1,
        {{"weak", "gap"}, {"session", sessionOf(map, step.session)}, {"length_m", rounded(step.length_m)}});
  }
}

void addImages(const TrainingMap& map, const MapFindings& findings, FeatureCollection& features) {
  const std::vector<bool> ambiguous = ambiguousImages(map, findings);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const TrainingPose image = map.pose(i);
    json properties{{"image", i},
                    {"session", sessionOf(map, image.session)},
                    {"stamp", secondsText(image.stamp_ns)},
                    {"yaw_rad", rounded(image.yaw_rad)},
                    {"features", map.featureCount(i)},
                    {"few_features", map.featureCount(i) < findings.config.few_features}};
    if (!ambiguous.empty()) properties["ambiguous"] = static_cast<bool>(ambiguous[i]);
    features.addPoint(i, std::move(properties));
  }
}

}  // namespace

void writeCsv(const TrainingMap& map, const MapFindings& findings, const TextSink& write) {
  const std::vector<bool> ambiguous = ambiguousImages(map, findings);
  write("stamp,session,east_m,north_m,yaw_rad,latitude_deg,longitude_deg,features,weak,ambiguous\n");
  for (std::size_t i = 0; i < map.size(); ++i) {
    const TrainingPose image = map.pose(i);
    const GeodeticPoint point = map.frame().toGeodetic(image.position_m);
    std::ostringstream row = numberStream();
    row << secondsText(image.stamp_ns) << ',' << csvQuoted(sessionOf(map, image.session)) << ',' << image.position_m.x()
        << ',' << image.position_m.y() << ',' << image.yaw_rad << ',' << point.latitude_deg << ','
        << point.longitude_deg << ',' << map.featureCount(i) << ','
        << (map.featureCount(i) < findings.config.few_features ? 1 : 0) << ',';
    if (!ambiguous.empty()) row << (ambiguous[i] ? 1 : 0);
    row << '\n';
    write(row.str());
  }
}

void writeGeoJson(const TrainingMap& map, const MapFindings& findings, const TextSink& write) {
  const SessionImages images = imagesOfSessions(map);
  FeatureCollection features(map, write);
  addPaths(map, images, features);
  addStretches(map, images, findings.survey.weak, "few features", features);
  if (findings.ambiguity) addStretches(map, images, findings.ambiguity->stretches, "ambiguous", features);
  addGaps(map, findings, features);
  addImages(map, findings, features);
  features.end();
}

}  // namespace visual_localization::apps
