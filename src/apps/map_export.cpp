#include "apps/map_export.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "apps/app_support.h"
#include "base/files.h"
#include "base/text.h"
#include "base/time.h"
#include "survey/map_survey.h"

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
    write_(text(feature("Point", coordinates(map_, image), std::move(properties))));
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
    write_("],\"type\":\"LineString\"},\"properties\":" + text(properties) + ",\"type\":\"Feature\"}");
  }

  void end() { write_("\n]}\n"); }

 private:
  /// The name of a session need not be UTF-8.
  static std::string text(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

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

namespace {

constexpr std::array<FixVerdict, 5> kVerdicts{FixVerdict::kKept, FixVerdict::kNoFix, FixVerdict::kDisordered,
                                              FixVerdict::kSpike, FixVerdict::kMultipath};

json toJson(const Eigen::Vector2d& position_m) { return {position_m.x(), position_m.y()}; }

json toJson(const std::vector<Eigen::Vector2d>& positions_m) {
  json all = json::array();
  for (const Eigen::Vector2d& position_m : positions_m) all.push_back(toJson(position_m));
  return all;
}

/// One without usable coordinates where the robot was.
std::optional<Eigen::Vector2d> positionOf(const Fix& fix, FixVerdict verdict, const Trajectory& path,
                                          const LocalFrame& frame) {
  if (verdict != FixVerdict::kNoFix && isValid(fix.position)) return frame.toEastNorth(fix.position);
  const auto point = path.at(fix.stamp_ns);
  return point ? std::optional<Eigen::Vector2d>(point->position_m) : std::nullopt;
}

json fixesOf(const PlottedSession& session, FixVerdict verdict, const LocalFrame& frame) {
  std::size_t count = 0;
  json positions = json::array();
  for (std::size_t i = 0; i < session.fixes.size(); ++i) {
    if (session.cleaned.verdicts[i] != verdict) continue;
    ++count;
    const auto position_m = positionOf(session.fixes[i], verdict, session.cleaned.trajectory, frame);
    if (position_m) positions.push_back(toJson(*position_m));
  }
  return {{"count", count}, {"positions_m", positions}};
}

/// Nothing between two points where the path was left open.
json pathsOf(const Trajectory& trajectory) {
  const std::vector<TrajectoryPoint>& points = trajectory.points();
  json paths = json::array();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool joined =
        i > 0 && trajectory.at(points[i - 1].stamp_ns + (points[i].stamp_ns - points[i - 1].stamp_ns) / 2);
    if (!joined) paths.push_back(json::array());
    paths.back().push_back(toJson(points[i].position_m));
  }
  return paths;
}

json toJson(const PlottedSession& session, const LocalFrame& frame) {
  json fixes;
  for (const FixVerdict verdict : kVerdicts) fixes[toString(verdict)] = fixesOf(session, verdict, frame);
  return {{"name", session.name},
          {"fixes", fixes},
          {"paths_m", pathsOf(session.cleaned.trajectory)},
          {"length_m", session.cleaned.trajectory.length()},
          {"gaps_closed", session.cleaned.gaps_closed},
          {"images_m", toJson(session.images_m)},
          {"landmarks_m", toJson(session.landmarks_m)}};
}

}  // namespace

void addMap(const TrainingMap& map, std::vector<PlottedSession>& sessions) {
  constexpr std::size_t kMostImages = 5000;
  constexpr std::size_t kMostLandmarks = 20000;
  for (std::size_t i = 0; i < map.size(); ++i) {
    sessions.at(static_cast<std::size_t>(map.pose(i).session)).images_m.push_back(map.position_m(i));
  }
  for (const LandmarkPoint& landmark : landmarkPoints(map, kMostImages, kMostLandmarks)) {
    sessions.at(static_cast<std::size_t>(landmark.session)).landmarks_m.emplace_back(landmark.position_m.head<2>());
  }
}

std::string mapPlotJson(const std::vector<PlottedSession>& sessions, const LocalFrame& frame) {
  json all = json::array();
  for (const PlottedSession& session : sessions) all.push_back(toJson(session, frame));
  // A file name need not be UTF-8.
  return json{{"sessions", all}}.dump(-1, ' ', false, json::error_handler_t::replace);
}

void drawMapPlot(const std::string& path, const std::vector<PlottedSession>& sessions, const LocalFrame& frame) {
  PartialFile data(path);  // never committed: disappears at the end, also when the program is interrupted
  data.write(mapPlotJson(sessions, frame));
  runScript("plot_map.py", {data.path(), path});
}

namespace {

constexpr double kColmapPixel = 0.5;  ///< COLMAP's centre of the upper left pixel, in either axis

/// Name of COLMAP's lens model and number of coefficients, in the order of sensor_msgs/CameraInfo.
std::pair<const char*, std::size_t> colmapLens(const CameraModel& camera) {
  const std::vector<double>& k = camera.intrinsics().coefficients;
  if (camera.intrinsics().distortion == Distortion::kEquidistant) return {"OPENCV_FISHEYE", 4};
  if (camera.isPinhole()) return {"PINHOLE", 0};
  const bool higher = std::any_of(k.begin() + 4, k.end(), [](double value) { return value != 0.0; });
  return higher ? std::make_pair("FULL_OPENCV", 8U) : std::make_pair("OPENCV", 4U);
}

/// COLMAP ends the name of an image at a space; a name that is taken gets the number of its session.
std::vector<std::string> colmapFolders(const TrainingMap& map) {
  std::vector<std::string> names;
  for (const Session& session : map.header().sessions) {
    std::string name = session.name;
    for (char& c : name) c = c <= ' ' || c > '~' || c == '/' ? '_' : c;
    const bool taken = std::find(names.begin(), names.end(), name) != names.end();
    names.push_back(taken ? name + '_' + std::to_string(names.size()) : name);
  }
  return names;
}

/// COLMAP's -1 when there is none.
double meanError(const std::vector<double>& errors_px) {
  if (errors_px.empty()) return -1.0;
  return std::accumulate(errors_px.begin(), errors_px.end(), 0.0) / static_cast<double>(errors_px.size());
}

}  // namespace

ColmapModel::ColmapModel(const TrainingMap& map) : map_(map), folders_(colmapFolders(map)) {}

std::string ColmapModel::cameras() {
  std::ostringstream out = numberStream();
  for (std::size_t s = 0; s < folders_.size(); ++s) {
    const auto& camera = map_.header().sessions[s].camera;
    if (!camera) continue;
    const auto [name, count] = colmapLens(*camera);
    Intrinsics of = camera->intrinsics();
    of.coefficients.resize(count);
    out << s + 1 << ' ' << name << ' ' << of.size.width << ' ' << of.size.height << ' ' << of.fx << ' ' << of.fy << ' '
        << of.cx + kColmapPixel << ' ' << of.cy + kColmapPixel;
    for (const double coefficient : of.coefficients) out << ' ' << coefficient;
    out << '\n';
    ++summary_.cameras;
  }
  return out.str();
}

std::string ColmapModel::image(std::size_t i) {
  const auto session = static_cast<std::size_t>(map_.pose(i).session);
  const auto geometry = map_.geometry(i);
  if (!geometry || !map_.header().sessions[session].camera) return "";
  const auto sift = map_.local(i);
  if (sift->size() != map_.featureCount(i)) {
    throw std::runtime_error("the features of image " + std::to_string(i) + " cannot be read (see --check)");
  }
  const Eigen::Quaterniond q = geometry->camera.rotation.conjugate();
  const Eigen::Vector3d t_m = geometry->camera.toCamera(Eigen::Vector3d::Zero());
  std::ostringstream out = numberStream();
  out << i + 1;
  for (const double value : {q.w(), q.x(), q.y(), q.z(), t_m.x(), t_m.y(), t_m.z()}) out << ' ' << value;
  out << ' ' << session + 1 << ' ' << folders_[session] << '/' << secondsText(map_.pose(i).stamp_ns) << ".png\n";
  addFeatures(i, *sift, *geometry, out);
  ++summary_.images;
  return out.str();
}

std::string ColmapModel::points() {
  std::ostringstream out = numberStream();
  std::vector<double> errors_px;
  for (const auto& [id, point] : points_) {
    const double error_px = meanError(point.errors_px);
    out << id << ' ' << point.position_m.x() << ' ' << point.position_m.y() << ' ' << point.position_m.z()
        << " 128 128 128 " << error_px << point.track << '\n';
    if (error_px >= 0.0) errors_px.push_back(error_px);
  }
  summary_.points = points_.size();
  summary_.error_px = meanError(errors_px);
  return out.str();
}

void ColmapModel::addFeatures(std::size_t i, const LocalFeatures& sift, const ImageGeometry& geometry,
                              std::ostream& out) {
  auto landmark = geometry.landmarks.begin();
  for (std::size_t f = 0; f < sift.size(); ++f) {
    const Keypoint& at = sift.keypoints()[f];
    const bool seen = landmark != geometry.landmarks.end() && landmark->feature == f;
    out << (f == 0 ? "" : " ") << at.x_px + kColmapPixel << ' ' << at.y_px + kColmapPixel << ' '
        << (seen ? std::to_string(landmark->id) : "-1");
    if (seen) addObservation(i, at, geometry.camera, *landmark++);
  }
  out << '\n';
}

void ColmapModel::addObservation(std::size_t i, const Keypoint& at, const CameraPose& pose,
                                 const SeenLandmark& landmark) {
  Point& point = points_[landmark.id];
  if (point.track.empty()) point.position_m = pose.position_m + landmark.offset_m.cast<double>();
  const CameraModel& camera = *map_.header().sessions[static_cast<std::size_t>(map_.pose(i).session)].camera;
  const Eigen::Vector2d projected = camera.project(pose.toCamera(point.position_m));
  if (projected.allFinite()) point.errors_px.push_back((projected - Eigen::Vector2d(at.x_px, at.y_px)).norm());
  ++summary_.observations;
  point.track += ' ' + std::to_string(i + 1) + ' ' + std::to_string(landmark.feature);
}

}  // namespace visual_localization::apps
