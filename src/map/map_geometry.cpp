#include "map/map_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <GeographicLib/Geodesic.hpp>

#include "base/numbers.h"
#include "base/time.h"
#include "geo/altitudes.h"
#include "geometry/session_geometry.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/map/map_builder.h"

namespace visual_localization {
namespace {

/// The middle of all valid fixes, axis by axis: unlike the first one it cannot be an outlier far away.
GeodeticPoint middleOf(const std::vector<Fix>& fixes) {
  std::vector<double> latitudes;
  std::vector<double> longitudes;
  for (const Fix& fix : fixes) {
    if (!hasPosition(fix)) continue;
    latitudes.push_back(fix.position.latitude_deg);
    longitudes.push_back(fix.position.longitude_deg);
  }
  if (latitudes.empty()) {
    throw std::runtime_error("none of its " + std::to_string(fixes.size()) +
                             " fixes is valid (latitude 0, longitude 0 is none)");
  }
  return {upperMedian(latitudes), upperMedian(longitudes), 0.0};
}

/// Of those fixes that have a position.
std::vector<AltitudeSample> altitudesOf(const std::vector<Fix>& fixes, const LocalFrame& frame) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<AltitudeSample> samples;
  for (const Fix& fix : fixes) {
    if (!hasPosition(fix)) continue;
    samples.push_back({frame.toEastNorth(fix.position), plausibleAltitude(fix.position.altitude_m).value_or(kNone)});
  }
  return samples;
}

/// The middle of their altitudes: a single one may be anything.
double datumAltitude(const std::vector<Fix>& fixes, const LocalFrame& frame) {
  std::vector<double> altitudes_m;
  for (const double altitude_m : steadyAltitudes(altitudesOf(fixes, frame))) {
    if (std::isfinite(altitude_m)) altitudes_m.push_back(altitude_m);
  }
  return median(std::move(altitudes_m));
}

}  // namespace

LocalFrame frameFor(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config) {
  const LocalFrame provisional(middleOf(fixes));
  const CleanedTrajectory cleaned = cleanTrajectory(fixes, provisional, config);
  std::vector<Fix> believed;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (cleaned.verdicts[i] == FixVerdict::kKept) believed.push_back(fixes[i]);
  }
  if (believed.empty()) throw std::runtime_error("none of its fixes is believable");
  GeodeticPoint datum = believed.front().position;
  datum.altitude_m = datumAltitude(believed, provisional);
  return LocalFrame(datum);
}

double distanceBetween_m(const GeodeticPoint& a, const GeodeticPoint& b) {
  double distance_m = 0.0;
  GeographicLib::Geodesic::WGS84().Inverse(a.latitude_deg, a.longitude_deg, b.latitude_deg, b.longitude_deg,
                                           distance_m);
  return distance_m;
}

void requireNear(const std::vector<Fix>& fixes, const GeodeticPoint& datum) {
  const double distance_m = distanceBetween_m(datum, middleOf(fixes));
  if (distance_m <= kFarthestSession_m) return;
  throw std::runtime_error("is " + std::to_string(std::llround(1e-3 * distance_m)) +
                           " km away from where the map begins, and one map reaches " +
                           std::to_string(std::llround(1e-3 * kFarthestSession_m)) + " km: build two maps");
}

void requireMotion(const CleanedTrajectory& cleaned) {
  Eigen::AlignedBox2d box;
  for (const TrajectoryPoint& point : cleaned.trajectory.points()) box.extend(point.position_m);
  if (box.diagonal().norm() >= kSmallestSession_m) return;
  const auto kept = std::count(cleaned.verdicts.begin(), cleaned.verdicts.end(), FixVerdict::kKept);
  throw std::runtime_error("its " + std::to_string(kept) + " believable fixes of " +
                           std::to_string(cleaned.verdicts.size()) + " are all at one point: the receiver was " +
                           "stuck, or the robot stood; a session spans at least 0.1 m");
}

std::vector<MapFix> inFrame(const std::vector<Fix>& fixes, const std::vector<FixVerdict>& verdicts,
                            const LocalFrame& frame) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (hasPosition(fixes[i]) && verdicts[i] != FixVerdict::kRepeated) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return fixes[a].stamp_ns < fixes[b].stamp_ns; });
  std::vector<Fix> ordered;
  for (const std::size_t i : order) ordered.push_back(fixes[i]);
  const std::vector<AltitudeSample> samples = altitudesOf(ordered, frame);
  const std::vector<double> altitudes_m = steadyAltitudes(samples);
  std::vector<MapFix> found;
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    const double up_m = altitudes_m[i] - frame.datum().altitude_m;
    found.push_back({ordered[i].stamp_ns, samples[i].position_m, ordered[i].sigma_m, up_m, ordered[i].sigma_up_m,
                     verdicts[order[i]] == FixVerdict::kKept});
  }
  return found;
}

SessionIndex::SessionIndex(const TrainingMap& map) : sessions_(map.header().sessions.size()) {
  std::vector<std::vector<Eigen::Vector2d>> positions_m(sessions_.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto session = static_cast<std::size_t>(map.pose(i).session);
    sessions_[session].images.push_back(i);
    positions_m[session].push_back(map.position_m(i));
  }
  for (std::size_t s = 0; s < sessions_.size(); ++s) {
    if (!positions_m[s].empty()) sessions_[s].index = std::make_unique<PositionIndex>(std::move(positions_m[s]));
  }
}

Neighbour SessionIndex::nearest(std::size_t session, const Eigen::Vector2d& position_m) const {
  const Neighbour found = sessions_[session].index->nearest(position_m);
  return {sessions_[session].images[found.image], found.distance_m};
}

void SessionIndex::nearest(std::size_t session, const Eigen::Vector2d& position_m, const PositionIndex::Search& search,
                           const std::function<bool(std::size_t image)>& accept, std::vector<Neighbour>& found) const {
  found.clear();
  if (!has(session)) return;
  const std::vector<std::size_t>& images = sessions_[session].images;
  sessions_[session].index->nearest(
      position_m, search, [&](std::size_t i) { return accept(images[i]); }, found);
  for (Neighbour& neighbour : found) neighbour.image = images[neighbour.image];
}

namespace {

using Covariance = Eigen::Matrix<double, 6, 6>;

/// Of a correlation, for what rounding to floats and the adjustment itself may do to it.
constexpr double kCorrelationTolerance = 1e-5;
constexpr double kUnitTolerance = 1e-6;

// All comparisons are such that one with NaN refuses.

void requirePose(const CameraPose& camera) {
  if (!(camera.position_m.cwiseAbs().maxCoeff() <= kLargestCoordinate_m) || !camera.position_m.allFinite()) {
    throw std::runtime_error("the camera's position is not finite or too far from the datum");
  }
  if (!(std::abs(camera.rotation.norm() - 1.0) <= kUnitTolerance)) {
    throw std::runtime_error("the camera's rotation is not of unit length");
  }
}

/// Correlations; false when there is a covariance without the variances for it.
bool toCorrelations(Covariance& covariance) {
  const Eigen::Matrix<double, 6, 1> sigmas = covariance.diagonal().cwiseSqrt();
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = 0; column < 6; ++column) {
      const double most = sigmas[row] * sigmas[column];
      double& value = covariance(row, column);
      if (!(std::abs(value) <= (1.0 + kCorrelationTolerance) * most)) return false;
      value = most > 0.0 ? value / most : 0.0;
    }
  }
  return true;
}

/// Symmetric and positive semi-definite, whatever the units of its rows.
bool isCovariance(Covariance covariance) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (!covariance.allFinite() || covariance.cwiseAbs().maxCoeff() > kLargest) return false;
  if (covariance.diagonal().minCoeff() < 0.0 || !toCorrelations(covariance)) return false;
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > kCorrelationTolerance) return false;
  covariance.diagonal().array() += kCorrelationTolerance;
  return covariance.llt().info() == Eigen::Success;
}

void requireLandmark(const SeenLandmark& landmark) {
  if (!(landmark.offset_m.cast<double>().norm() <= kLongestOffset_m)) {
    throw std::runtime_error("a landmark's offset is not finite or too long");
  }
  for (const float sigma_m : {landmark.sigma_along_m, landmark.sigma_across_m}) {
    if (!(sigma_m >= 0.0F && std::isfinite(sigma_m))) {
      throw std::runtime_error("a landmark's standard deviation is not finite or negative");
    }
  }
}

/// Images [begin, end) of the map, which are one session.
UnadjustedSession unadjusted(const TrainingMap& map, std::size_t begin, std::size_t end, const Session& of,
                             const std::vector<MapFix>& fixes) {
  UnadjustedSession session;
  for (std::size_t i = begin; i < end; ++i) {
    session.images.push_back({map.pose(i).stamp_ns, map.position_m(i), map.yaw_rad(i)});
  }
  session.features = [&map, begin](std::size_t i) { return map.local(begin + i); };
  session.kind = map.header().kind;
  session.camera = of.camera ? &*of.camera : nullptr;
  session.mount = of.mount.value_or(SensorMount());
  session.finds_mount = !of.mount;
  session.fixes = fixes;
  return session;
}

/// Where the robot was by the path of its antenna: it looks where it drives.
std::vector<TrajectoryPoint> pathByAntenna(const TrainingMap& map, std::size_t begin, std::size_t end,
                                           const SensorMount& mount) {
  std::vector<TrajectoryPoint> path;
  for (std::size_t i = begin; i < end; ++i) {
    const double yaw_rad = map.yaw_rad(i);
    const Eigen::Vector2d antenna_m = Eigen::Rotation2Dd(yaw_rad) * mount.antenna_m.head<2>();
    path.push_back({map.pose(i).stamp_ns, map.position_m(i) - antenna_m, yaw_rad});
  }
  return path;
}

double wayAlong_m(const std::vector<TrajectoryPoint>& path, std::size_t begin, std::size_t end) {
  double way_m = 0.0;
  for (std::size_t i = begin; i < end; ++i) way_m += (path[i + 1].position_m - path[i].position_m).norm();
  return way_m;
}

/// What is between `begin` and `end`, which have moved from where they were `before`, moves with them.
void moveBetween(std::size_t begin, std::size_t end, const std::vector<TrajectoryPoint>& before,
                 std::vector<TrajectoryPoint>& path) {
  const Eigen::Vector2d moved_m = path[begin].position_m - before[begin].position_m;
  const Eigen::Vector2d more_m = path[end].position_m - before[end].position_m - moved_m;
  const double turned_rad = angleDifference(before[begin].yaw_rad, path[begin].yaw_rad);
  const double more_rad = angleDifference(turned_rad, angleDifference(before[end].yaw_rad, path[end].yaw_rad));
  const double elapsed_s = secondsBetween(path[begin].stamp_ns, path[end].stamp_ns);
  for (std::size_t i = begin + 1; i < end; ++i) {
    const double share = secondsBetween(path[begin].stamp_ns, path[i].stamp_ns) / elapsed_s;
    path[i].position_m += moved_m + share * more_m;
    path[i].yaw_rad = std::remainder(path[i].yaw_rad + turned_rad + share * more_rad, 2.0 * kPi);
  }
}

/// The first image of each session, and the end of the last one.
std::vector<std::size_t> begins(const TrainingMap& map, std::size_t sessions) {
  std::vector<std::size_t> begins(sessions + 1, 0);
  for (std::size_t i = 0; i < map.size(); ++i) ++begins[static_cast<std::size_t>(map.pose(i).session) + 1];
  for (std::size_t k = 0; k < sessions; ++k) begins[k + 1] += begins[k];
  return begins;
}

}  // namespace

void requireUsable(const ImageGeometry& geometry, std::size_t feature_count) {
  requirePose(geometry.camera);
  if (!isCovariance(geometry.covariance)) {
    throw std::runtime_error("the covariance of the camera's pose is not symmetric and positive semi-definite");
  }
  std::size_t lowest = 0;
  for (const SeenLandmark& landmark : geometry.landmarks) {
    if (landmark.feature >= feature_count) {
      throw std::runtime_error("a landmark belongs to feature " + std::to_string(landmark.feature) + " of " +
                               std::to_string(feature_count));
    }
    if (landmark.feature < lowest) throw std::runtime_error("the landmarks are not in order of their features");
    lowest = std::size_t{landmark.feature} + 1;
    requireLandmark(landmark);
  }
}

void keepFeatures(const std::vector<std::size_t>& kept, TrainingImage& image) {
  image.local = image.local.subset(kept);
  if (!image.geometry) return;
  std::vector<SeenLandmark> landmarks;
  for (SeenLandmark landmark : image.geometry->landmarks) {
    const auto feature = std::lower_bound(kept.begin(), kept.end(), std::size_t{landmark.feature});
    if (feature == kept.end() || *feature != landmark.feature) continue;
    landmark.feature = static_cast<std::uint32_t>(feature - kept.begin());
    landmarks.push_back(landmark);
  }
  image.geometry->landmarks = std::move(landmarks);
}

std::vector<TrajectoryPoint> adjustedPath(const std::vector<TrajectoryPoint>& by_antenna, const SensorMount& mount,
                                          const std::vector<std::optional<ImageGeometry>>& images) {
  constexpr double kBetween_m = 30.0;
  std::vector<TrajectoryPoint> path = by_antenna;
  std::optional<std::size_t> last;  // that a camera has placed
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!images[i]) continue;
    const Eigen::Isometry3d base = mount.baseInMap(images[i]->camera);
    path[i].position_m = base.translation().head<2>();
    path[i].yaw_rad = yawOf(base);
    if (last && wayAlong_m(by_antenna, *last, i) <= kBetween_m) moveBetween(*last, i, by_antenna, path);
    last = i;
  }
  return path;
}

void placeByCamera(TrainingImage& image, const SensorMount& mount, ImageGeometry geometry) {
  const Eigen::Isometry3d base = mount.baseInMap(geometry.camera);
  image.position_m = base.translation().head<2>();
  image.yaw_rad = yawOf(base);
  image.geometry = std::move(geometry);
}

std::vector<std::optional<SessionGeometry>> geometryOf(const TrainingMap& unpruned,
                                                       const std::vector<Session>& sessions,
                                                       const std::vector<std::vector<MapFix>>& fixes,
                                                       const std::vector<double>& clock_sigmas_s,
                                                       const GeometryConfig& config, std::size_t threads) {
  const std::vector<std::size_t> begin = begins(unpruned, sessions.size());
  std::vector<UnadjustedSession> calibrated;
  std::vector<std::size_t> which;
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    if (!sessions[k].camera) continue;
    calibrated.push_back(unadjusted(unpruned, begin[k], begin[k + 1], sessions[k], fixes[k]));
    calibrated.back().clock_sigma_s = clock_sigmas_s[k];
    which.push_back(k);
  }
  std::vector<SessionGeometry> adjusted = adjustSessions(calibrated, config, threads);
  std::vector<std::optional<SessionGeometry>> geometries(sessions.size());
  for (std::size_t i = 0; i < which.size(); ++i) geometries[which[i]] = std::move(adjusted[i]);
  return geometries;
}

std::vector<std::optional<CameraModel>> calibrateByImages(const TrainingMap& unpruned,
                                                          const std::vector<Session>& sessions,
                                                          const std::vector<std::vector<MapFix>>& fixes,
                                                          const GeometryConfig& config, std::size_t threads) {
  const std::vector<std::size_t> begin = begins(unpruned, sessions.size());
  std::vector<std::optional<CameraModel>> cameras(sessions.size());
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    if (sessions[k].camera) continue;
    cameras[k] = calibrateByImages(unadjusted(unpruned, begin[k], begin[k + 1], sessions[k], fixes[k]),
                                   unpruned.header().image_size, config, threads);
  }
  return cameras;
}

std::size_t writeThinned(const TrainingMap& unpruned, const std::vector<Session>& sessions,
                         std::vector<std::optional<SessionGeometry>> geometries, const MapBuilderConfig& config,
                         const std::function<void(std::size_t i, TrainingImage&)>& prune,
                         const std::function<void(const TrainingImage&)>& sink) {
  const std::vector<std::size_t> begin = begins(unpruned, geometries.size());
  std::size_t thinned = 0;
  for (std::size_t k = 0; k < geometries.size(); ++k) {
    SpacingFilter spacing(geometries[k] ? std::max(config.spacing_m, config.geometry.spacing_m) : config.spacing_m);
    const SensorMount mount = sessions[k].mount.value_or(SensorMount());
    std::vector<TrajectoryPoint> path = pathByAntenna(unpruned, begin[k], begin[k + 1], mount);
    if (geometries[k]) path = adjustedPath(path, mount, geometries[k]->images);
    for (std::size_t i = begin[k]; i < begin[k + 1]; ++i) {
      TrainingImage image = unpruned.image(i);
      const TrajectoryPoint& at = path[i - begin[k]];
      image.position_m = at.position_m;
      image.yaw_rad = at.yaw_rad;
      if (geometries[k]) image.geometry = std::move(geometries[k]->images[i - begin[k]]);
      prune(i, image);
      if (spacing.keeps(image.position_m)) {
        sink(image);
      } else {
        ++thinned;
      }
    }
  }
  return thinned;
}

}  // namespace visual_localization
