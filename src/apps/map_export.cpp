#include "apps/map_export.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <sstream>
#include <vector>

namespace visual_localization::apps {
namespace {

/// As text inside JSON or CSV quotes; `quote` is how a quote is written there.
std::string quoted(const std::string& text, const std::string& quote, bool json) {
  static const char* const digits = "0123456789abcdef";
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') {
      result += quote;
    } else if (json && c == '\\') {
      result += "\\\\";
    } else if (json && c >= 0 && c < 32) {
      result += {'\\', 'u', '0', '0', digits[c / 16], digits[c % 16]};
    } else {
      result += c;
    }
  }
  return result + "\"";
}

std::string seconds(std::int64_t stamp_ns) {
  std::ostringstream text;
  text << (stamp_ns < 0 ? "-" : "");
  const std::uint64_t magnitude =
      stamp_ns < 0 ? 0 - static_cast<std::uint64_t>(stamp_ns) : static_cast<std::uint64_t>(stamp_ns);
  text << magnitude / 1'000'000'000 << '.' << std::setw(9) << std::setfill('0') << magnitude % 1'000'000'000;
  return text.str();
}

std::string sessionName(const TrainingMap& map, int session, const std::string& quote, bool json) {
  return quoted(map.header().sessions[static_cast<std::size_t>(session)], quote, json);
}

/// Which images are ambiguous; empty when nobody looked.
std::vector<bool> ambiguousImages(const TrainingMap& map, const MapFindings& findings) {
  std::vector<bool> ambiguous(findings.ambiguity ? map.size() : 0, false);
  if (!findings.ambiguity) return ambiguous;
  for (const AmbiguousImage& image : findings.ambiguity->images) ambiguous[image.image] = true;
  return ambiguous;
}

/// GeoJSON order: longitude first.
std::string coordinates(const TrainingMap& map, std::size_t i) {
  const GeodeticPoint place = map.frame().toGeodetic(map.position_m(i));
  std::ostringstream out;
  out << std::setprecision(12) << '[' << place.longitude_deg << ',' << place.latitude_deg << ']';
  return out.str();
}

std::string feature(const std::string& type, const std::string& where, const std::string& properties) {
  return R"({"type":"Feature","geometry":{"type":")" + type + "\",\"coordinates\":" + where + "},\"properties\":{" +
         properties + "}}";
}

/// Successive positions; a line has at least two.
class Line {
 public:
  void add(const std::string& position) {
    where_ += (where_.empty() ? "" : ",") + position;
    last_ = position;
    ++points_;
  }
  std::size_t points() const { return points_; }
  std::string coordinates() const { return "[" + where_ + (points_ == 1 ? "," + last_ : "") + "]"; }

 private:
  std::string where_;
  std::string last_;
  std::size_t points_ = 0;
};

void addPaths(const TrainingMap& map, std::vector<std::string>& features) {
  std::vector<Line> paths(map.header().sessions.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    paths[static_cast<std::size_t>(map.pose(i).session)].add(coordinates(map, i));
  }
  for (std::size_t s = 0; s < paths.size(); ++s) {
    if (paths[s].points() == 0) continue;
    features.push_back(feature("LineString", paths[s].coordinates(),
                               "\"session\":" + sessionName(map, static_cast<int>(s), "\\\"", true) +
                                   ",\"images\":" + std::to_string(paths[s].points())));
  }
}

/// Each image is looked at once, however the stretches of several sessions are interleaved.
void addStretches(const TrainingMap& map, const std::vector<Stretch>& stretches, const std::string& flaw,
                  std::vector<std::string>& features) {
  std::vector<Line> lines(stretches.size());
  std::vector<std::vector<std::size_t>> of_session(map.header().sessions.size());
  for (std::size_t s = stretches.size(); s-- > 0;) {
    of_session[static_cast<std::size_t>(stretches[s].session)].push_back(s);  // the first one at the back
  }
  for (std::size_t i = 0; i < map.size(); ++i) {
    auto& waiting = of_session[static_cast<std::size_t>(map.pose(i).session)];
    if (waiting.empty() || i < stretches[waiting.back()].first) continue;
    lines[waiting.back()].add(coordinates(map, i));
    if (i == stretches[waiting.back()].last) waiting.pop_back();
  }
  for (std::size_t s = 0; s < stretches.size(); ++s) {
    std::ostringstream properties;
    properties << R"("weak":")" << flaw << R"(","session":)" << sessionName(map, stretches[s].session, "\\\"", true)
               << ",\"images\":" << stretches[s].images << ",\"length_m\":" << stretches[s].length_m
               << ",\"least_features\":" << stretches[s].least_features;
    features.push_back(feature("LineString", lines[s].coordinates(), properties.str()));
  }
}

void addGaps(const TrainingMap& map, const MapFindings& findings, std::vector<std::string>& features) {
  for (const Step& step : findings.survey.longest_steps) {
    if (step.length_m <= findings.config.gap_m) continue;
    Line line;
    line.add(coordinates(map, step.from));
    line.add(coordinates(map, step.to));
    std::ostringstream properties;
    properties << R"("weak":"gap","session":)" << sessionName(map, step.session, "\\\"", true)
               << ",\"length_m\":" << step.length_m;
    features.push_back(feature("LineString", line.coordinates(), properties.str()));
  }
}

void addImages(const TrainingMap& map, const MapFindings& findings, std::vector<std::string>& features) {
  const std::vector<bool> ambiguous = ambiguousImages(map, findings);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const TrainingPose image = map.pose(i);
    std::ostringstream properties;
    properties << "\"image\":" << i << ",\"session\":" << sessionName(map, image.session, "\\\"", true)
               << ",\"stamp\":\"" << seconds(image.stamp_ns) << "\",\"yaw_rad\":" << image.yaw_rad
               << ",\"features\":" << map.featureCount(i)
               << ",\"few_features\":" << (map.featureCount(i) < findings.config.few_features ? "true" : "false");
    if (!ambiguous.empty()) properties << ",\"ambiguous\":" << (ambiguous[i] ? "true" : "false");
    features.push_back(feature("Point", coordinates(map, i), properties.str()));
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
    const GeodeticPoint place = map.frame().toGeodetic(image.position_m);
    out << seconds(image.stamp_ns) << ',' << sessionName(map, image.session, "\"\"", false) << ','
        << image.position_m.x() << ',' << image.position_m.y() << ',' << image.yaw_rad << ',' << place.latitude_deg
        << ',' << place.longitude_deg << ',' << map.featureCount(i) << ','
        << (map.featureCount(i) < findings.config.few_features ? 1 : 0) << ',';
    if (!ambiguous.empty()) out << (ambiguous[i] ? 1 : 0);
    out << '\n';
  }
  return out.str();
}

std::string toGeoJson(const TrainingMap& map, const MapFindings& findings) {
  std::vector<std::string> features;
  addPaths(map, features);
  addStretches(map, findings.survey.weak, "few features", features);
  if (findings.ambiguity) addStretches(map, findings.ambiguity->stretches, "ambiguous", features);
  addGaps(map, findings, features);
  addImages(map, findings, features);
  std::ostringstream out;
  out << "{\"type\":\"FeatureCollection\",\"features\":[\n";
  for (std::size_t f = 0; f < features.size(); ++f) out << features[f] << (f + 1 < features.size() ? ",\n" : "\n");
  out << "]}\n";
  return out.str();
}

}  // namespace visual_localization::apps
