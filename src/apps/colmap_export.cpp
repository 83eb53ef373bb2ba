#include <algorithm>
#include <cstddef>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "apps/app_support.h"
#include "apps/map_export.h"
#include "base/files.h"
#include "base/text.h"
#include "base/time.h"

namespace visual_localization::apps {
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
