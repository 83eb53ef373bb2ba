#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "app_support.h"
#include "visual_localization/io/partial_file.h"
#include "visual_localization/map/map_store.h"

namespace visual_localization {
namespace {

struct Options {
  std::string map;
  bool check = false;
  std::string geojson;
  std::string csv;
};

/// Metres along the images of one session, in their order.
double lengthOf(const TrainingMap& map, int session) {
  double length_m = 0.0;
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map.place(i).session != session) continue;
    if (last) length_m += (map.position_m(i) - map.position_m(*last)).norm();
    last = i;
  }
  return length_m;
}

void printSessions(const TrainingMap& map) {
  for (std::size_t s = 0; s < map.header().sessions.size(); ++s) {
    const auto session = static_cast<int>(s);
    std::size_t count = 0;
    for (std::size_t i = 0; i < map.size(); ++i) count += map.place(i).session == session ? 1 : 0;
    std::cout << "session:     " << map.header().sessions[s] << ", " << count << " images, " << lengthOf(map, session)
              << " m\n";
  }
}

void printFeatures(const TrainingMap& map) {
  std::vector<std::size_t> counts;
  std::size_t total = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    counts.push_back(map.featureCount(i));
    total += map.featureCount(i);
  }
  std::sort(counts.begin(), counts.end());
  std::cout << "features:    " << total << ", per image min " << counts.front() << ", median "
            << counts[counts.size() / 2] << ", max " << counts.back() << '\n';
}

/// Whether the localizer will have all of it in memory unless told otherwise.
std::string whereItsFeaturesAre(double file_bytes) {
  return file_bytes <= static_cast<double>(MapLoading().cache_bytes)
             ? "features are read at the start"
             : "features are read when needed (map_cache_mb: " + std::to_string(kDefaultMapCache_mb) + ")";
}

void printMap(const Options& options, const TrainingMap& map) {
  const MapHeader& header = map.header();
  std::cout << "map:         " << options.map << ", version " << kMapSchemaVersion
            << ", written by visual_localization " << packageVersionOf(options.map) << '\n';
  std::cout << std::setprecision(9) << "datum:       " << header.datum.latitude_deg << " deg, "
            << header.datum.longitude_deg << " deg, " << header.datum.altitude_m << " m\n";
  std::cout << "images:      " << map.size() << " of " << header.image_size.width << 'x' << header.image_size.height
            << " px\n";
  std::cout << "sift:        " << header.sift.octave_layers << " layers, contrast " << header.sift.contrast_threshold
            << ", edge " << header.sift.edge_threshold << ", sigma " << header.sift.sigma_px << " px, at most "
            << (header.sift.max_features == 0 ? std::string("all") : std::to_string(header.sift.max_features))
            << " features\n";
  std::cout << std::fixed << std::setprecision(1);
  printSessions(map);
  const Area& area = map.area();
  std::cout << "area:        east " << area.min_m.x() << " to " << area.max_m.x() << " m, north " << area.min_m.y()
            << " to " << area.max_m.y() << " m\n";
  printFeatures(map);
  const auto bytes = static_cast<double>(std::filesystem::file_size(options.map));
  std::cout << "size:        " << apps::humanSize(bytes) << " on disk, " << whereItsFeaturesAre(bytes) << '\n';
}

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

std::string toCsv(const TrainingMap& map) {
  std::ostringstream out;
  out << "stamp,session,east_m,north_m,yaw_rad,latitude_deg,longitude_deg,features\n" << std::setprecision(17);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const TrainingPlace image = map.place(i);
    const GeodeticPoint place = map.frame().toGeodetic(image.position_m);
    out << seconds(image.stamp_ns) << ','
        << quoted(map.header().sessions[static_cast<std::size_t>(image.session)], "\"\"", false) << ','
        << image.position_m.x() << ',' << image.position_m.y() << ',' << image.yaw_rad << ',' << place.latitude_deg
        << ',' << place.longitude_deg << ',' << map.featureCount(i) << '\n';
  }
  return out.str();
}

/// GeoJSON order: longitude first.
std::string coordinates(const TrainingMap& map, std::size_t i) {
  const GeodeticPoint place = map.frame().toGeodetic(map.position_m(i));
  std::ostringstream out;
  out << std::setprecision(12) << '[' << place.longitude_deg << ',' << place.latitude_deg << ']';
  return out.str();
}

std::string feature(const std::string& type, const std::string& where, const std::string& properties) {
  return "{\"type\":\"Feature\",\"geometry\":{\"type\":\"" + type + "\",\"coordinates\":" + where +
         "},\"properties\":{" + properties + "}}";
}

std::string pathFeature(const TrainingMap& map, std::size_t session) {
  std::string where;
  std::size_t count = 0;
  std::string last;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (static_cast<std::size_t>(map.place(i).session) != session) continue;
    last = coordinates(map, i);
    where += (where.empty() ? "" : ",") + last;
    ++count;
  }
  if (count == 0) return {};
  if (count == 1) where += "," + last;  // a line has at least two points
  return feature(
      "LineString", "[" + where + "]",
      "\"session\":" + quoted(map.header().sessions[session], "\\\"", true) + ",\"images\":" + std::to_string(count));
}

std::string toGeoJson(const TrainingMap& map) {
  std::ostringstream out;
  out << "{\"type\":\"FeatureCollection\",\"features\":[\n";
  for (std::size_t s = 0; s < map.header().sessions.size(); ++s) {
    const std::string path = pathFeature(map, s);
    if (!path.empty()) out << path << ",\n";
  }
  for (std::size_t i = 0; i < map.size(); ++i) {
    const TrainingPlace image = map.place(i);
    std::ostringstream properties;
    properties << "\"image\":" << i << ",\"session\":"
               << quoted(map.header().sessions[static_cast<std::size_t>(image.session)], "\\\"", true)
               << ",\"stamp\":\"" << seconds(image.stamp_ns) << "\",\"yaw_rad\":" << image.yaw_rad
               << ",\"features\":" << map.featureCount(i);
    out << feature("Point", coordinates(map, i), properties.str()) << (i + 1 < map.size() ? ",\n" : "\n");
  }
  out << "]}\n";
  return out.str();
}

void showMap(const Options& options) {
  for (const std::string& output : {options.geojson, options.csv}) {
    if (!output.empty()) apps::requireNoInput("--export", output, {options.map});
  }
  if (options.check) checkMap(options.map);
  const auto map = loadMap(options.map);
  printMap(options, *map);
  if (options.check) std::cout << "check:       ok\n";
  if (!options.geojson.empty()) writeFile(options.geojson, toGeoJson(*map));
  if (!options.csv.empty()) writeFile(options.csv, toCsv(*map));
}

}  // namespace
}  // namespace visual_localization

int main(int argc, char** argv) {
  CLI::App app("Shows what a map holds, checks it and exports it.", "map_info");
  visual_localization::Options options;
  app.add_option("map", options.map, "the map file")->required();
  app.add_flag("--check", options.check, "verify every checksum and the structure of the file");
  app.add_option("--export-geojson", options.geojson, "write path and images as GeoJSON (WGS84)");
  app.add_option("--export-csv", options.csv, "write one line an image");
  return visual_localization::apps::runProgram(app, argc, argv, [&options] { visual_localization::showMap(options); });
}
