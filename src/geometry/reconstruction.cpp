#include "geometry/reconstruction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.h"
#include "geometry/fix_positions.h"
#include "geometry/landmark_covariance.h"
#include "geometry/rotation_vector.h"
#include "geometry/triangulation.h"
#include "geometry/vector_median.h"

namespace visual_localization {
namespace {

constexpr double kMinAngle_rad = 0.01;  ///< between two rays to a landmark
constexpr std::size_t kNeighbours = 7;  ///< on each side of an image
constexpr double kAstray_m = 2.0;       ///< an image moved by this more or less than its neighbours lost its way
constexpr double kAstray_rad = 0.1;     ///< so did one that was turned by this more or less
constexpr double kFarthest_m = 1000.0;  ///< a landmark farther away has no position to rely on
constexpr double kFar_m = 3.0;          ///< an image moved by more than this is far from the cleaned path
constexpr std::size_t kEnoughTracked =
    20;  ///< tracked features of an image on average, for their share to say anything
constexpr int kMostFocalSteps = 100;
constexpr double kAttitudeSigma_rad = 0.004;  ///< of a training image in the map

}  // namespace

void Reconstruction::add(const UnadjustedSession& session, std::vector<KeypointRays> rays,
                         const AveragedRotations& rotations, std::vector<Eigen::Quaterniond> travel,
                         const PathHeights& heights) {
  const auto begin = static_cast<std::uint32_t>(images_.size());
  std::vector<double> sigmas_m;
  for (PositionObservation fix : positionsAt(session.images, session.fixes, config_.fix_sigma_m)) {
    sigmas_m.push_back(fix.sigma_m);
    fix.image += begin;
    fix.sigma_m *= config_.fix_correlation;
    fixes_.push_back(fix);
  }
  fix_sigmas_m_.push_back(sigmas_m.empty() ? config_.fix_sigma_m : median(sigmas_m));
  const Eigen::Vector3d antenna_m = session.mount.antennaInCamera_m();
  problem_.sessions.push_back({begin, rotations.mounting_rad, Eigen::Vector2d::Zero(), antenna_m});
  for (std::size_t i = 0; i < session.images.size(); ++i) {
    const TrajectoryPoint& image = session.images[i];
    const Eigen::Quaterniond& start = rotations.camera_in_map[i];
    const double up_m = heights.up_m.empty() ? 0.0 : heights.up_m[i];
    const Eigen::Vector3d antenna_in_map_m(image.position_m.x(), image.position_m.y(), up_m);
    images_.push_back({static_cast<std::uint32_t>(sessions_.size()), image, std::move(rays[i]), start, up_m});
    problem_.cameras.push_back({start, antenna_in_map_m - start * antenna_m});
    problem_.travel.push_back(travel[i]);
    problem_.slopes.push_back(heights.slope.empty() ? 0.0 : heights.slope[i]);
    if (heights.up_m.empty()) continue;
    problem_.heights.push_back(
        {begin + static_cast<std::uint32_t>(i), up_m, config_.fix_correlation * heights.sigma_m});
  }
  sessions_.push_back(&session);
}

void Reconstruction::append(const Reconstruction& other) {
  const auto begin = static_cast<std::uint32_t>(images_.size());
  const auto session = static_cast<std::uint32_t>(sessions_.size());
  for (Image image : other.images_) {
    image.session += session;
    images_.push_back(std::move(image));
  }
  for (PositionObservation fix : other.fixes_) {
    fix.image += begin;
    fixes_.push_back(fix);
  }
  for (HeightObservation height : other.problem_.heights) {
    height.image += begin;
    problem_.heights.push_back(height);
  }
  for (BundleSession added : other.problem_.sessions) {
    added.begin += begin;
    problem_.sessions.push_back(added);
  }
  for (Landmark landmark : other.problem_.landmarks) {
    for (LandmarkSighting& sighting : landmark.sightings) sighting.image += begin;
    problem_.landmarks.push_back(std::move(landmark));
  }
  const auto add = [](const auto& from, auto& to) { to.insert(to.end(), from.begin(), from.end()); };
  add(other.sessions_, sessions_);
  add(other.fix_sigmas_m_, fix_sigmas_m_);
  add(other.problem_.cameras, problem_.cameras);
  add(other.problem_.travel, problem_.travel);
  add(other.problem_.slopes, problem_.slopes);
}

void Reconstruction::move(std::size_t session, const std::vector<Eigen::Vector3d>& shifts_m) {
  const std::size_t begin = problem_.sessions[session].begin;
  for (std::size_t i = 0; i < shifts_m.size(); ++i) problem_.cameras[begin + i].position_m += shifts_m[i];
  for (Landmark& landmark : problem_.landmarks) {
    const std::uint32_t first = landmark.sightings.front().image;
    if (images_[first].session == session) landmark.position_m += shifts_m[first - begin];
  }
}

void Reconstruction::setMatches(const std::vector<ImagePair>& matches) {
  std::vector<std::size_t> feature_counts;
  for (const Image& image : images_) feature_counts.push_back(image.rays.normalised.size());
  tracks_ = tracksOf(matches, feature_counts, kMinViews);
}

void Reconstruction::useFixes(double farthest_m, double loss) {
  bundle_.position_loss = loss;
  problem_.positions.clear();
  for (const PositionObservation& fix : fixes_) {
    if ((fix.east_north_m - images_[fix.image].cleaned.position_m).norm() <= farthest_m) {
      problem_.positions.push_back(fix);
    }
  }
}

void Reconstruction::triangulateAll(double gate_px, std::size_t max_views) {
  problem_.landmarks.clear();
  for (const FeatureTrack& track :
       cutTracks(tracks_, max_views, [this](std::uint32_t image) { return sessionOf(image); })) {
    Landmark landmark;
    std::vector<Sight> sights;
    for (const FeatureObservation& seen : track) {
      const KeypointRays& rays = images_[seen.image].rays;
      sights.push_back({&problem_.cameras[seen.image], rays.normalised[seen.feature]});
      landmark.sightings.push_back({seen.image, seen.feature, sights.back().normalised, rays.sigmas[seen.feature]});
    }
    const std::optional<Eigen::Vector3d> point = triangulate(sights, kMinAngle_rad);
    if (!point) continue;
    landmark.position_m = *point;
    auto& all = landmark.sightings;
    const auto is_off = [&](const LandmarkSighting& sighting) {
      return !(error(landmark, sighting) * focal_px(sighting.image) <= gate_px);
    };
    all.erase(std::remove_if(all.begin(), all.end(), is_off), all.end());
    if (all.size() >= 2) problem_.landmarks.push_back(std::move(landmark));
  }
}

void Reconstruction::adjustAndPrune(double tolerance, std::size_t min_views) {
  bundle_.tolerance = tolerance;
  adjust(problem_, bundle_);
  for (Landmark& landmark : problem_.landmarks) {
    auto& all = landmark.sightings;
    const auto disagrees = [&](const LandmarkSighting& sighting) {
      return !(error(landmark, sighting) <= config_.max_residual_sigmas * sighting.sigma);
    };
    all.erase(std::remove_if(all.begin(), all.end(), disagrees), all.end());
  }
  auto& all = problem_.landmarks;
  const auto lost = [&](const Landmark& landmark) {
    return landmark.sightings.size() < min_views || !(distance_m(landmark) <= kFarthest_m);
  };
  all.erase(std::remove_if(all.begin(), all.end(), lost), all.end());
}

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

bool Reconstruction::isAstray(std::size_t image) const {
  return !((shiftOf_m(image) - usualShift_m(image)).norm() <= kAstray_m &&
           (turnOf_rad(image) - usualTurn_rad(image)).norm() <= kAstray_rad);
}

void Reconstruction::bringBack() {
  std::vector<std::pair<std::size_t, CameraPose>> back;
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (!isAstray(i)) continue;
    CameraPose pose{images_[i].start * Eigen::Quaterniond(exponential(usualTurn_rad(i))), Eigen::Vector3d::Zero()};
    pose.position_m = startOf_m(i) + usualShift_m(i) - antennaInMap_m(pose, i);
    back.emplace_back(i, pose);
  }
  for (const auto& [image, pose] : back) problem_.cameras[image] = pose;
}

double Reconstruction::freeFocalScale(double tolerance) const {
  BundleProblem problem = problem_;
  BundleConfig config = bundle_;
  config.focal_is_free = true;
  config.tolerance = tolerance;
  config.max_iterations = kMostFocalSteps;
  adjust(problem, config);
  return problem.focal_scale;
}

/// In normalised coordinates.
double Reconstruction::error(const Landmark& landmark, const LandmarkSighting& sighting) const {
  return reprojectionError(problem_.cameras[sighting.image], landmark.position_m, sighting.normalised);
}

double Reconstruction::distance_m(const Landmark& landmark) const {
  return (landmark.position_m - problem_.cameras[landmark.sightings.front().image].position_m).norm();
}

std::vector<SessionGeometry> Reconstruction::results(std::uint32_t first_id) const {
  std::vector<SessionGeometry> geometries(sessions_.size());
  std::vector<std::vector<double>> errors_px(sessions_.size());
  std::vector<std::size_t> tracked(sessions_.size());
  std::vector<ImageGeometry> images(images_.size());
  const std::vector<std::set<std::uint32_t>> tied = tiedSessions();
  for (std::size_t i = 0; i < images.size(); ++i) images[i] = imageAt(i, tied[i]);
  for (const Landmark& landmark : problem_.landmarks) {
    const Eigen::Matrix3d covariance = covarianceOf(landmark, problem_.cameras);
    ++geometries[sessionOf(landmark.sightings.front().image)].landmarks;
    for (const LandmarkSighting& sighting : landmark.sightings) {
      errors_px[sessionOf(sighting.image)].push_back(error(landmark, sighting) * focal_px(sighting.image));
      addSighting(landmark, covariance, sighting.feature, first_id, images[sighting.image]);
    }
    ++first_id;
  }
  for (const FeatureTrack& track : tracks_) {
    for (const FeatureObservation& seen : track) ++tracked[sessionOf(seen.image)];
  }
  addPath(images, geometries);
  for (std::size_t k = 0; k < geometries.size(); ++k) {
    SessionGeometry& geometry = geometries[k];
    geometry.sightings = errors_px[k].size();
    if (tracked[k] >= kEnoughTracked * geometry.images.size()) {
      geometry.agreeing_share = static_cast<double>(geometry.sightings) / static_cast<double>(tracked[k]);
    }
    geometry.median_error_px = median(errors_px[k]);
    geometry.mounting_rad = problem_.sessions[k].mounting_rad;
    geometry.fix_delay_s = problem_.sessions[k].fix_delay_s;
  }
  return geometries;
}

/// The sessions that show landmarks of each image, its own included.
std::vector<std::set<std::uint32_t>> Reconstruction::tiedSessions() const {
  std::vector<std::set<std::uint32_t>> tied(images_.size());
  for (std::size_t i = 0; i < images_.size(); ++i) tied[i].insert(images_[i].session);
  for (const Landmark& landmark : problem_.landmarks) {
    std::set<std::uint32_t> sessions;
    for (const LandmarkSighting& sighting : landmark.sightings) sessions.insert(images_[sighting.image].session);
    if (sessions.size() == 1) continue;
    for (const LandmarkSighting& sighting : landmark.sightings)
      tied[sighting.image].insert(sessions.begin(), sessions.end());
  }
  return tied;
}

/// Receivers err slowly, each recording by itself: where several are tied, their errors average out.
double Reconstruction::fixBias_m(const std::set<std::uint32_t>& tied) const {
  double information = 0.0;
  for (const std::uint32_t session : tied) {
    const double bias_m = std::max(config_.fix_bias * fix_sigmas_m_[session], 0.01);
    information += 1.0 / (bias_m * bias_m);
  }
  return 1.0 / std::sqrt(information);
}

ImageGeometry Reconstruction::imageAt(std::size_t image, const std::set<std::uint32_t>& tied) const {
  ImageGeometry geometry;
  geometry.camera = problem_.cameras[image];
  Eigen::Matrix<double, 6, 1> sigmas;
  const double bias_m = fixBias_m(tied);
  sigmas << bias_m, bias_m, bias_m, kAttitudeSigma_rad, kAttitudeSigma_rad, kAttitudeSigma_rad;
  geometry.covariance = sigmas.cwiseAbs2().asDiagonal();
  return geometry;
}

/// Images with enough landmarks, and how far they were moved.
void Reconstruction::addPath(const std::vector<ImageGeometry>& images, std::vector<SessionGeometry>& geometries) const {
  for (std::size_t i = 0; i < images.size(); ++i) {
    SessionGeometry& geometry = geometries[sessionOf(i)];
    const auto least = static_cast<std::size_t>(config_.min_landmarks);
    if (images[i].landmarks.size() < least || isAstray(i)) {
      geometry.images.emplace_back();
      continue;
    }
    ImageGeometry& image = geometry.images.emplace_back(images[i]).value();
    std::sort(image.landmarks.begin(), image.landmarks.end(),
              [](const SeenLandmark& a, const SeenLandmark& b) { return a.feature < b.feature; });
    ++geometry.located;
    const double shift_m = shiftOf_m(i).head<2>().norm();
    geometry.mean_shift_m += shift_m;
    geometry.largest_shift_m = std::max(geometry.largest_shift_m, shift_m);
    geometry.far_share += shift_m > kFar_m ? 1.0 : 0.0;
  }
  for (SessionGeometry& geometry : geometries) {
    if (geometry.located > 0) geometry.mean_shift_m /= static_cast<double>(geometry.located);
    geometry.far_share /= static_cast<double>(std::max<std::size_t>(1, geometry.images.size()));
  }
}

}  // namespace visual_localization
