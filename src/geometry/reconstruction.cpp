#include "geometry/reconstruction.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "base/numbers.h"
#include "geometry/rays.h"

namespace visual_localization {
namespace {

constexpr double kMinAngle_rad = 0.01;     ///< between two rays to a landmark
constexpr double kFarthest_m = 1000.0;     ///< a landmark farther away has no position to rely on
constexpr double kSignificant = 3.0;       ///< sigmas
constexpr double kSignificantDelay = 2.0;  ///< the same, of which half wrong is as bad either way
constexpr double kStampSigma_s = 0.03;     ///< what stamps of exact clocks still leave: exposure, transport, rounding
constexpr double kHeld = 1e-9;             ///< a sigma that holds
constexpr std::size_t kLensWindows = 5;    ///< that are asked for the calibration, about
constexpr std::size_t kOverlap = 4;        ///< a window shares this part of its images with the next one

}  // namespace

void Reconstruction::add(const UnadjustedSession& session, std::vector<KeypointRays> rays,
                         const AveragedRotations& rotations, const std::vector<RelativeRotation>& relative,
                         const std::vector<double>& directions, const FeatureSets& sets) {
  const auto begin = static_cast<std::uint32_t>(images_.size());
  for (PositionObservation fix : positionsAt(session.images, session.fixes, sigmaOfUndeclared_m(config_))) {
    fix.image += begin;
    fix.sigma_m *= kFixCorrelation;
    fixes_.push_back(fix);
  }
  budgets_.emplace_back();
  const Eigen::Vector3d antenna_m = session.mount.antennaInCamera_m();
  BundleSession& added = problem_.sessions.emplace_back();
  added.begin = begin;
  added.lens = addLens({session.camera->intrinsics(), LensCorrection::Zero()});
  const Mounting mounting = mountingOf(session.mount);
  added.mounting = mounting.rotation;
  added.mounting_sigma_rad = mounting.sigma_rad;
  added.mounting_rad = rotations.mounting_rad;
  added.antenna_m = antenna_m;
  added.fix_delay_sigma_s = session.clock_sigma_s;
  const PathHeights heights = pathHeights(session.images, session.fixes);
  for (std::size_t i = 0; i < session.images.size(); ++i) {
    const TrajectoryPoint& image = session.images[i];
    const Eigen::Quaterniond& start = rotations.camera_in_map[i];
    const double up_m = heights.up_m[i];
    const Eigen::Vector3d antenna_in_map_m(image.position_m.x(), image.position_m.y(), up_m);
    images_.push_back({static_cast<std::uint32_t>(sessions_.size()), image, std::move(rays[i]), start, up_m});
    problem_.cameras.push_back({start, antenna_in_map_m - start * antenna_m});
    problem_.road.push_back({directions[i], heights.slope[i]});
    ranks_.push_back(ranks_.size());
    if (!heights.measured) continue;
    problem_.heights.push_back({begin + static_cast<std::uint32_t>(i), up_m, kFixCorrelation * heights.sigma_m});
  }
  sessions_.push_back(&session);
  relative_ = relative;
  sets_.append(sets);
}

void Reconstruction::append(const Reconstruction& other) {
  const auto begin = static_cast<std::uint32_t>(images_.size());
  const auto session = static_cast<std::uint32_t>(sessions_.size());
  for (Image image : other.images_) {
    image.session += session;
    images_.push_back(std::move(image));
    ranks_.push_back(ranks_.size());
  }
  for (PositionObservation fix : other.fixes_) {
    fix.image += begin;
    fixes_.push_back(fix);
  }
  for (RelativeRotation relative : other.relative_) {
    relative.a += begin;
    relative.b += begin;
    relative_.push_back(relative);
  }
  for (HeightObservation height : other.problem_.heights) {
    height.image += begin;
    problem_.heights.push_back(height);
  }
  for (BundleSession added : other.problem_.sessions) {
    added.begin += begin;
    added.lens = addLens(other.problem_.lenses[added.lens]);
    problem_.sessions.push_back(added);
  }
  for (Landmark landmark : other.problem_.landmarks) {
    for (LandmarkObservation& observation : landmark.observations) observation.image += begin;
    problem_.landmarks.push_back(std::move(landmark));
  }
  const auto add = [](const auto& from, auto& to) { to.insert(to.end(), from.begin(), from.end()); };
  add(other.sessions_, sessions_);
  add(other.budgets_, budgets_);
  add(other.problem_.cameras, problem_.cameras);
  add(other.problem_.road, problem_.road);
  sets_.append(other.sets_);
  applyLenses(session);
}

/// One that is there already, if it has the same calibration: one camera took the images of both.
std::size_t Reconstruction::addLens(const BundleLens& lens) {
  const CameraModel published(lens.published);
  std::size_t i = 0;
  while (i < problem_.lenses.size() && CameraModel(problem_.lenses[i].published) != published) ++i;
  if (i == problem_.lenses.size()) problem_.lenses.push_back(lens);
  return i;
}

Intrinsics Reconstruction::lensOf(std::size_t session) const {
  const BundleLens& lens = problem_.lenses[problem_.sessions[session].lens];
  return corrected(lens.published, lens.correction);
}

const LensCorrection& Reconstruction::lensCorrection(std::size_t session) const {
  return problem_.lenses[problem_.sessions[session].lens].correction;
}

void Reconstruction::move(std::size_t session, const std::vector<Eigen::Vector3d>& shifts_m) {
  const std::size_t begin = problem_.sessions[session].begin;
  for (std::size_t i = 0; i < shifts_m.size(); ++i) problem_.cameras[begin + i].position_m += shifts_m[i];
  for (Landmark& landmark : problem_.landmarks) {
    const std::uint32_t first = landmark.observations.front().image;
    if (images_[first].session == session) landmark.position_m += shifts_m[first - begin];
  }
}

void Reconstruction::tie(const std::vector<ImagePair>& ties) {
  for (std::size_t k = 0; k < sessions(); ++k) {
    // What counts is how they compare: with large ones alone the common path slides along a flat valley of the cost.
    const double most_m = budgets_[k].assumed ? sigmaOfUndeclared_m(config_) : budgets_[k].sigma_m;
    problem_.sessions[k].fix_bias_sigma_m = std::min(budgets_[k].sigma_m, most_m);
  }
  orderBy(ties);
  for (const ImagePair& pair : ties) sets_.join(pair);
}

void Reconstruction::useFixes(double farthest_m, double loss) {
  bundle_.position_loss = loss;
  problem_.positions.clear();
  for (const PositionObservation& fix : fixes_) {
    if (isWithin(farthest_m, fix)) problem_.positions.push_back(fix);
  }
}

/// Of the cleaned path.
bool Reconstruction::isWithin(double farthest_m, const PositionObservation& fix) const {
  return (fix.east_north_m - images_[fix.image].cleaned.position_m).norm() <= farthest_m;
}

void Reconstruction::moveAsOne() { visual_localization::moveAsOne(problem_, bundle_); }

void Reconstruction::triangulateAll(double gate_px, std::size_t max_views) {
  triangulateWithout(std::vector<bool>(images_.size()), gate_px, max_views);
}

void Reconstruction::triangulateWithout(const std::vector<bool>& left_out, double gate_px, std::size_t max_views) {
  problem_.landmarks.clear();
  const auto session_of = [this](std::uint32_t image) { return sessionOf(image); };
  for (FeatureTrack& track : sets_.tracks(kMinViews)) {
    track.erase(std::remove_if(track.begin(), track.end(), [&](const auto& seen) { return left_out[seen.image]; }),
                track.end());
    if (track.size() < 2) continue;
    for (const FeatureTrack& piece : cutTrack(track, max_views, session_of)) addLandmark(piece, gate_px);
  }
}

void Reconstruction::addLandmark(const FeatureTrack& track, double gate_px) {
  Landmark landmark;
  landmark.observations.reserve(track.size());
  std::vector<Sight> sights;
  for (const FeatureObservation& seen : track) {
    const KeypointRays& rays = images_[seen.image].rays;
    sights.push_back({&problem_.cameras[seen.image], rays.normalised[seen.feature]});
    landmark.observations.push_back({seen.image, seen.feature, rays.pixels[seen.feature].cast<double>(),
                                     static_cast<double>(rays.sigmas_px[seen.feature])});
  }
  const std::optional<Eigen::Vector3d> point = triangulate(sights, kMinAngle_rad);
  if (!point) return;
  landmark.position_m = *point;
  auto& all = landmark.observations;
  const auto is_off = [&](const LandmarkObservation& observation) {
    return !(reprojectionError_px(problem_, landmark, observation) <= gate_px);
  };
  all.erase(std::remove_if(all.begin(), all.end(), is_off), all.end());
  if (all.size() >= 2) problem_.landmarks.push_back(std::move(landmark));
}

/// All images at once, or so many at a time, each window with the last ones of the window before. What is behind a
/// window is left out: it would hold the window where it was.
std::vector<BundleWindow> Reconstruction::windows() const {
  const auto most = static_cast<std::size_t>(config_.window);
  if (images_.size() <= most) return {{}};
  const std::size_t step = most - most / kOverlap;
  std::vector<BundleWindow> windows;
  for (std::size_t begin = 0; windows.empty() || windows.back().end < images_.size(); begin += step) {
    const std::size_t end = std::min(begin + most, images_.size());
    windows.push_back({&ranks_, begin, end, 0, end});
  }
  return windows;
}

void Reconstruction::adjustWindows() {
  const std::vector<BundleWindow> all = windows();
  BundleConfig config = bundle_;
  if (all.size() > 1) {
    adjustLenses(all);
    config.lens_sigma.setZero();
  }
  for (const BundleWindow& window : all) adjust(problem_, config, window);
}

void Reconstruction::adjustAndPrune(double tolerance, std::size_t min_views) {
  bundle_.tolerance = tolerance;
  adjustWindows();
  if (!bundle_.lens_sigma.isZero(0.0)) applyLenses(0);
  for (Landmark& landmark : problem_.landmarks) {
    auto& all = landmark.observations;
    const auto disagrees = [&](const LandmarkObservation& observation) {
      return !(reprojectionError_px(problem_, landmark, observation) <= kMaxResidual * observation.sigma_px);
    };
    all.erase(std::remove_if(all.begin(), all.end(), disagrees), all.end());
  }
  auto& all = problem_.landmarks;
  const auto lost = [&](const Landmark& landmark) {
    return landmark.observations.size() < min_views || !(distance_m(landmark) <= kFarthest_m);
  };
  all.erase(std::remove_if(all.begin(), all.end(), lost), all.end());
}

/// With those landmarks only that its cameras see.
BundleProblem Reconstruction::problemOf(const BundleWindow& window) const {
  BundleProblem problem{problem_.cameras, {}, problem_.positions, problem_.heights, problem_.road, problem_.sessions,
                        problem_.lenses};
  std::copy_if(problem_.landmarks.begin(), problem_.landmarks.end(), std::back_inserter(problem.landmarks),
               [&window](const Landmark& landmark) {
                 return std::any_of(
                     landmark.observations.begin(), landmark.observations.end(),
                     [&](const LandmarkObservation& observation) { return window.moves(observation.image); });
               });
  return problem;
}

/// By the median of what some windows say, each on its own: a lens is one for all of them.
void Reconstruction::adjustLenses(const std::vector<BundleWindow>& windows) {
  if (bundle_.lens_sigma.isZero(0.0)) return;
  std::vector<std::vector<LensCorrection>> found(problem_.lenses.size());
  for (std::size_t i = 0; i < windows.size(); i += 1 + windows.size() / kLensWindows) {
    BundleProblem problem = problemOf(windows[i]);
    BundleWindow window = windows[i];
    window.known_begin = window.begin;  // the others keep to the lens that they have
    window.known_end = window.end;
    adjust(problem, bundle_, window);
    for (std::size_t k = 0; k < found.size(); ++k) found[k].push_back(problem.lenses[k].correction);
  }
  for (std::size_t k = 0; k < found.size(); ++k) {
    for (Eigen::Index entry = 0; entry < LensCorrection::RowsAtCompileTime; ++entry) {
      std::vector<double> values;
      for (const LensCorrection& correction : found[k]) values.push_back(correction[entry]);
      problem_.lenses[k].correction[entry] = median(values);
    }
  }
}

/// By a window in the middle, if there are several: it knows them less well than all of them.
SharedSigmas Reconstruction::sharedSigmasNow() const {
  const std::vector<BundleWindow> all = windows();
  if (all.size() == 1) return sharedSigmas(problem_, bundle_, all.front());
  BundleWindow window = all[all.size() / 2];
  window.known_begin = window.begin;
  window.known_end = window.end;
  return sharedSigmas(problemOf(window), bundle_, window);
}

void Reconstruction::keepSignificant(bool focal_is_known) {
  shared_ = sharedSigmasNow();
  LensCorrection& correction = problem_.lenses.front().correction;
  for (Eigen::Index entry = 0; entry < correction.size(); ++entry) {
    if (std::abs(correction[entry]) > kSignificant * shared_.lens[entry]) continue;
    if (entry == kFocalLength && !focal_is_known) continue;
    correction[entry] = shared_.lens[entry] = 0.0;
    bundle_.lens_sigma[entry] = std::min(bundle_.lens_sigma[entry], kHeld);
  }
  double& delay_s = problem_.sessions.front().fix_delay_s;
  if (std::abs(delay_s) > kSignificantDelay * std::hypot(shared_.fix_delay_s, kStampSigma_s)) return;
  delay_s = shared_.fix_delay_s = 0.0;
  problem_.sessions.front().fix_delay_sigma_s = kHeld;
}

/// The rays of all keypoints from a session on, by the lenses as they are now.
void Reconstruction::applyLenses(std::size_t first_session) {
  for (std::size_t session = first_session; session < sessions_.size(); ++session) {
    const CameraModel camera(lensOf(session));
    for (std::size_t i = begin(session); i < begin(session) + imagesIn(session); ++i) {
      setCamera(camera, images_[i].rays);
    }
  }
}

double Reconstruction::distance_m(const Landmark& landmark) const {
  return (landmark.position_m - problem_.cameras[landmark.observations.front().image].position_m).norm();
}

}  // namespace visual_localization
