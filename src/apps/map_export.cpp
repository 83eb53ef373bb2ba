#include "apps/map_export.h"

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/app_support.h"
#include "base/text.h"
#include "base/time.h"

namespace visual_localization::apps {
namespace {

using nlohmann::json;

const std::string& sessionOf(const TrainingMap& map, int session) {
  return map.header().sessions[static_cast<std::size_t>(session)].name;
}

/// With this many significant digits: more would only pretend.
double rounded(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return std::strtod(text.data(), nullptr);
}

/// A length or an angle.
double rounded(double value) { return rounded(value, 6); }

/// Which images are ambiguous; empty when that was not checked.
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

/// Successive positions as a line, which has at least two.
json line(json positions, json properties) {
  if (positions.size() == 1) positions.push_back(positions.front());
  return feature("LineString", std::move(positions), std::move(properties));
}

/// The features of a map, one a line, so that a large map is never a tree in memory.
class FeatureCollection {
 public:
  void add(const json& feature) {
    text_ += text_.empty() ? "" : ",\n";
    // The name of a session need not be UTF-8.
    text_ += feature.dump(-1, ' ', false, json::error_handler_t::replace);
  }
  std::string text() const { return "{\"type\":\"FeatureCollection\",\"features\":[\n" + text_ + "\n]}\n"; }

 private:
  std::string text_;
};

void addPaths(const TrainingMap& map, FeatureCollection& features) {
  std::vector<json> paths(map.header().sessions.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    paths[static_cast<std::size_t>(map.pose(i).session)].push_back(coordinates(map, i));
  }
  for (std::size_t s = 0; s < paths.size(); ++s) {
    if (paths[s].empty()) continue;
    const std::size_t images = paths[s].size();
    features.add(line(std::move(paths[s]), {{"session", sessionOf(map, static_cast<int>(s))}, {"images", images}}));
  }
}

/// Each image is looked at once, however the stretches of several sessions are interleaved.
void addStretches(const TrainingMap& map, const std::vector<Stretch>& stretches, const std::string& flaw,
                  FeatureCollection& features) {
  std::vector<json> lines(stretches.size());
  std::vector<std::vector<std::size_t>> of_session(map.header().sessions.size());
  for (std::size_t s = stretches.size(); s-- > 0;) {
    of_session[static_cast<std::size_t>(stretches[s].session)].push_back(s);  // the first one at the back
  }
  for (std::size_t i = 0; i < map.size(); ++i) {
    auto& waiting = of_session[static_cast<std::size_t>(map.pose(i).session)];
    if (waiting.empty() || i < stretches[waiting.back()].first) continue;
    lines[waiting.back()].push_back(coordinates(map, i));
    if (i == stretches[waiting.back()].last) waiting.pop_back();
  }
  for (std::size_t s = 0; s < stretches.size(); ++s) {
    features.add(line(std::move(lines[s]), {{"weak", flaw},
                                            {"session", sessionOf(map, stretches[s].session)},
                                            {"images", stretches[s].images},
                                            {"length_m", rounded(stretches[s].length_m)},
                                            {"least_features", stretches[s].least_features}}));
  }
}

void addGaps(const TrainingMap& map, const MapFindings& findings, FeatureCollection& features) {
  for (const Step& step : findings.survey.longest_steps) {
    if (step.length_m <= findings.config.gap_m) continue;
    features.add(
        line({coordinates(map, step.from), coordinates(map, step.to)},
             {{"weak", "gap"}, {"session", sessionOf(map, step.session)}, {"length_m", rounded(step.length_m)}}));
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
    features.add(feature("Point", coordinates(map, i), std::move(properties)));
  }
}

}  // namespace

std::string toCsv(const TrainingMap& map, const MapFindings& findings) {
  const std::vector<bool> ambiguous = ambiguousImages(map, findings);
  std::ostringstream out;
  out << "stamp,session,east_m,north_m,yaw_rad,latitude_deg,longitude_deg,features,weak,ambiguous\n"
      << std::setprecision(17);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const TrainingPose image = map.pose(i);
    const GeodeticPoint point = map.frame().toGeodetic(image.position_m);
    out << secondsText(image.stamp_ns) << ',' << csvQuoted(sessionOf(map, image.session)) << ',' << image.position_m.x()
        << ',' << image.position_m.y() << ',' << image.yaw_rad << ',' << point.latitude_deg << ','
        << point.longitude_deg << ',' << map.featureCount(i) << ','
        << (map.featureCount(i) < findings.config.few_features ? 1 : 0) << ',';
    if (!ambiguous.empty()) out << (ambiguous[i] ? 1 : 0);
    out << '\n';
  }
  return out.str();
}

std::string toGeoJson(const TrainingMap& map, const MapFindings& findings) {
  FeatureCollection features;
  addPaths(map, features);
  addStretches(map, findings.survey.weak, "few features", features);
  if (findings.ambiguity) addStretches(map, findings.ambiguity->stretches, "ambiguous", features);
  addGaps(map, findings, features);
  addImages(map, findings, features);
  return features.text();
}

ColmapSummary writeColmap(const TrainingMap& map, const std::string& folder) {
  NewFolder files(folder);
  ColmapModel model(map);
  files.add("cameras.txt").write(model.cameras());
  PartialFile& images = files.add("images.txt");
  for (std::size_t i = 0; i < map.size(); ++i) images.write(model.image(i));
  files.add("points3D.txt").write(model.points());
  if (model.summary().points == 0) throw std::runtime_error(folder + ": not written: the map has no landmarks");
  files.commit();
  return model.summary();
}

}  // namespace visual_localization::apps
