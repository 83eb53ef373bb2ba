#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/numbers.h"
#include "geometry/feature_tracks.h"
#include "geometry/pose_solver.h"
#include "geometry/rays.h"
#include "geometry/reconstruction.h"
#include "geometry/seen_landmarks.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 7;  ///< on each side of an image
constexpr double kAstray_m = 2.0;       ///< an image moved by this more or less than its neighbours lost its way
constexpr double kAstray_rad = 0.1;     ///< so did one that was turned by this more or less
constexpr double kMostExplained = 0.5;
constexpr double kResected_px = 3.0;  ///< from the projection of a landmark that a pose explains
constexpr int kResections = 5;

bool isMost(const std::vector<bool>& images) {
  return 2 * static_cast<std::size_t>(std::count(images.begin(), images.end(), true)) > images.size();
}

}  // namespace

Eigen::Vector3d Reconstruction::antennaInMap_m(const CameraPose& camera, std::size_t image) const {
  return camera.position_m + camera.rotation * problem_.sessions[sessionOf(image)].antenna_m;
}

/// Where the cleaned path and the altitudes have the antenna.
Eigen::Vector3d Reconstruction::startOf_m(std::size_t image) const {
  const Eigen::Vector2d& position_m = images_[image].cleaned.position_m;
  return {position_m.x(), position_m.y(), images_[image].up_m};
}

Eigen::Vector3d Reconstruction::shiftOf_m(std::size_t image) const {
  return antennaInMap_m(problem_.cameras[image], image) - startOf_m(image);
}

/// How far the adjustment turned it: a rotation vector in the camera's frame.
Eigen::Vector3d Reconstruction::turnOf_rad(std::size_t image) const {
  const Eigen::AngleAxisd turn(images_[image].start.conjugate() * problem_.cameras[image].rotation);
  return turn.angle() * turn.axis();
}

/// On the path of its session, the image itself included.
std::vector<std::size_t> Reconstruction::neighboursOf(std::size_t image) const {
  std::vector<std::size_t> neighbours;
  for (std::size_t i = image - std::min(image, kNeighbours); i < images_.size() && i <= image + kNeighbours; ++i) {
    if (images_[i].session == images_[image].session) neighbours.push_back(i);
  }
  return neighbours;
}

/// How far the adjustment moved the neighbours of an image on the cleaned path.
Eigen::Vector3d Reconstruction::usualShift_m(std::size_t image) const {
  std::vector<Eigen::Vector3d> shifts_m;
  for (const std::size_t neighbour : neighboursOf(image)) shifts_m.push_back(shiftOf_m(neighbour));
  return medianOf(shifts_m);
}

Eigen::Vector3d Reconstruction::usualTurn_rad(std::size_t image) const {
  std::vector<Eigen::Vector3d> turns_rad;
  for (const std::size_t neighbour : neighboursOf(image)) turns_rad.push_back(turnOf_rad(neighbour));
  return medianOf(turns_rad);
}

/// Of each image the share of its tracked features that show landmarks; nothing for few tracked features.
std::vector<std::optional<double>> Reconstruction::explainedShares() const {
  std::vector<std::size_t> tracked(images_.size());
  for (const FeatureTrack& track : sets_.tracks(kMinViews)) {
    for (const FeatureObservation& seen : track) ++tracked[seen.image];
  }
  std::vector<std::size_t> observations(images_.size());
  for (const Landmark& landmark : problem_.landmarks) {
    for (const LandmarkObservation& observation : landmark.observations) ++observations[observation.image];
  }
  std::vector<std::optional<double>> shares(images_.size());
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (tracked[i] < kEnoughTracked) continue;
    shares[i] = static_cast<double>(observations[i]) / static_cast<double>(tracked[i]);
  }
  return shares;
}

/// Moved or turned unlike its neighbours. An image of which most matches fit is not astray, whatever fixes say.
bool Reconstruction::isAstray(std::size_t image, const std::optional<double>& explained) const {
  if (explained.value_or(0.0) > kMostExplained) return false;
  return !((shiftOf_m(image) - usualShift_m(image)).norm() <= kAstray_m &&
           (turnOf_rad(image) - usualTurn_rad(image)).norm() <= kAstray_rad);
}

/// Of each image of `some`: its tracked features, with the landmarks that other images have for them.
std::vector<std::vector<LandmarkMatch>> Reconstruction::landmarksOf(const std::vector<bool>& some) const {
  const SeenLandmarks landmarks(problem_.landmarks);
  std::vector<std::vector<LandmarkMatch>> matches(images_.size());
  for (const FeatureTrack& track : sets_.tracks(kMinViews)) {
    const auto shown = std::find_if(track.begin(), track.end(), [&](const auto& seen) { return landmarks.at(seen); });
    if (shown == track.end()) continue;
    const Eigen::Vector3d& landmark_m = landmarks.at(*shown)->position_m;
    for (const auto& [image, feature] : track) {
      if (!some[image]) continue;
      const KeypointRays& rays = images_[image].rays;
      matches[image].push_back(
          {feature, 0, rays.normalised[feature], rays.sigmas[feature], landmark_m, Eigen::Matrix3d::Zero()});
    }
  }
  return matches;
}

/// Images of which landmarks explain too little.
std::vector<bool> Reconstruction::lostImages() const {
  std::vector<bool> lost;
  for (const auto& explained : explainedShares()) lost.push_back(explained.value_or(1.0) < kMostExplained);
  return lost;
}

bool Reconstruction::mostAreLost() const { return isMost(lostImages()); }

/// By the landmarks of the other images: these must be the most.
void Reconstruction::resect(double gate_px, std::size_t max_views) {
  for (int round = 0; round < kResections; ++round) {
    const std::vector<bool> lost = lostImages();
    if (isMost(lost) || std::find(lost.begin(), lost.end(), true) == lost.end()) return;
    triangulateWithout(lost, gate_px, max_views);
    const std::vector<std::vector<LandmarkMatch>> matches = landmarksOf(lost);
    for (std::size_t i = 0; i < images_.size(); ++i) {
      const auto solved = solvePose(matches[i], kResected_px / focal_px(i), kMinLandmarks);
      if (solved) problem_.cameras[i] = solved->camera;
    }
    triangulateAll(gate_px, max_views);
  }
}

void Reconstruction::restartAmongNeighbours() {
  std::vector<std::pair<std::size_t, CameraPose>> back;
  const std::vector<std::optional<double>> explained = explainedShares();
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (!isAstray(i, explained[i])) continue;
    CameraPose pose{images_[i].start * Eigen::Quaterniond(exponential(usualTurn_rad(i))), Eigen::Vector3d::Zero()};
    pose.position_m = startOf_m(i) + usualShift_m(i) - antennaInMap_m(pose, i);
    back.emplace_back(i, pose);
  }
  for (const auto& [image, pose] : back) problem_.cameras[image] = pose;
}

}  // namespace visual_localization
