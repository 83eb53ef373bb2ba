// What a reconstruction came to, as the map takes it, and how the next session is laid beside it.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"
#include "geometry/bundle_adjustment.h"
#include "geometry/rays.h"
#include "geometry/reconstruction.h"
#include "geometry/seen_landmarks.h"

namespace visual_localization {
namespace {

/// Sigmas from believed fixes, where it is as likely by chance as 3.4 sigmas on a line.
constexpr double kOffFixes = 3.7;
constexpr double kLeastExplained = 1.0 / 3.0;  ///< of what is matched; leaves and people move
constexpr double kBeyondClaim = 2.0;           ///< times what a receiver claims, its fixes are off a whole path
constexpr double kAttitudeSigma_rad = 0.004;   ///< of a training image in the map
constexpr double kLeastSigma_m = 0.01;         ///< of a path

}  // namespace

std::vector<SessionGeometry> Reconstruction::results(std::uint32_t first_id) const {
  std::vector<SessionGeometry> geometries(sessions_.size());
  std::vector<std::vector<double>> errors_px(sessions_.size());
  std::vector<std::size_t> tracked(sessions_.size());
  std::vector<ImageGeometry> images(images_.size());
  const std::vector<std::vector<PathEvidence>> paths = evidence();
  std::vector<std::vector<PathDoubt>> doubts;
  for (std::size_t k = 0; k < paths.size(); ++k) {
    doubts.push_back(doubtsOf(paths[k], budgets_[k].sigma_m));
    if (budgets_[k].residual_m <= kBeyondClaim * budgets_[k].declared_m) continue;
    for (PathDoubt& doubt : doubts.back()) doubt.fails = true;  // its sigma has grown by the budget
  }
  const std::vector<TiedSessions> tied = tiedSessions(doubts);
  const CommonBudget common = commonBudgetOf(tied);
  std::vector<std::vector<double>> sigmas_m(sessions_.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    sigmas_m[sessionOf(i)].push_back(mapSigma_m(tied[i], common));
    images[i] = imageAt(i, sigmas_m[sessionOf(i)].back());
  }
  for (const Landmark& landmark : problem_.landmarks) {
    const Eigen::Matrix3d covariance = covarianceOf(landmark, problem_);
    ++geometries[sessionOf(landmark.observations.front().image)].landmarks;
    for (const LandmarkObservation& observation : landmark.observations) {
      errors_px[sessionOf(observation.image)].push_back(reprojectionError_px(problem_, landmark, observation));
      addObservation(landmark, covariance, observation.feature, first_id, images[observation.image]);
    }
    ++first_id;
  }
  for (const FeatureTrack& track : sets_.tracks(kMinViews)) {
    for (const FeatureObservation& seen : track) ++tracked[sessionOf(seen.image)];
  }
  addPath(std::move(images), geometries);
  for (std::size_t k = 0; k < geometries.size(); ++k) {
    SessionGeometry& geometry = geometries[k];
    geometry.observations = errors_px[k].size();
    if (tracked[k] >= kEnoughTracked * geometry.images.size()) {
      geometry.agreeing_share = static_cast<double>(geometry.observations) / static_cast<double>(tracked[k]);
    }
    geometry.median_error_px = median(errors_px[k]);
    const BundleSession& session = problem_.sessions[k];
    const Eigen::AngleAxisd mounting(session.mounting * Eigen::Quaterniond(exponential(session.mounting_rad)));
    geometry.mounting_rad = mounting.angle() * mounting.axis();
    geometry.mounting_off_rad = session.mounting * session.mounting_rad;
    geometry.fix_delay_s = problem_.sessions[k].fix_delay_s;
    geometry.lens = lensOf(k);
    geometry.focal_scale = std::exp(lensCorrection(k)[kFocalLength]);
    geometry.focal_sigma = shared_.lens[kFocalLength];
    geometry.delay_sigma_s = shared_.fix_delay_s;
    geometry.doubtful = doubtfulStretches(paths[k], doubts[k], sigmas_m[k]);
    geometry.fixes = budgets_[k];
    double squared_m2 = 0.0;
    for (const double sigma_m : sigmas_m[k]) squared_m2 += sigma_m * sigma_m;
    geometry.fixes.sigma_m = std::sqrt(squared_m2 / static_cast<double>(sigmas_m[k].size()));
  }
  return geometries;
}

std::vector<DrivenHeading> Reconstruction::drivenHeadings() const {
  const BundleSession& session = problem_.sessions.front();
  const Eigen::Quaterniond camera_from_robot =
      (levelCamera(0.0) * session.mounting * Eigen::Quaterniond(exponential(session.mounting_rad))).conjugate();
  const auto yaw_rad = [&](std::size_t i) {
    const Eigen::Vector3d ahead = problem_.cameras[i].rotation * camera_from_robot * Eigen::Vector3d::UnitX();
    return std::atan2(ahead.y(), ahead.x());
  };
  std::vector<DrivenHeading> driven;
  for (std::size_t i = 1; i + 1 < problem_.cameras.size(); ++i) {
    const std::optional<Eigen::Vector3d> way_m = wayAt(problem_, i);
    if (!way_m) continue;
    const double direction = problem_.road[i].direction;
    driven.push_back({angleDifference(std::atan2(direction * way_m->y(), direction * way_m->x()), yaw_rad(i)),
                      direction * angleDifference(yaw_rad(i - 1), yaw_rad(i + 1)) / way_m->norm()});
  }
  return driven;
}

/// The sessions that show landmarks of each image, its own included.
std::vector<Reconstruction::TiedSessions> Reconstruction::tiedSessions(
    const std::vector<std::vector<PathDoubt>>& doubts) const {
  const auto doubt_m = [&](std::size_t i) { return doubts[sessionOf(i)][i - begin(sessionOf(i))].m(); };
  std::vector<TiedSessions> tied(images_.size());
  for (std::size_t i = 0; i < images_.size(); ++i) tied[i][sessionOf(i)] = doubt_m(i);
  for (const Landmark& landmark : problem_.landmarks) {
    TiedSessions sessions;
    for (const LandmarkObservation& observation : landmark.observations) {
      const double here_m = doubt_m(observation.image);
      const auto added = sessions.emplace(sessionOf(observation.image), here_m).first;
      added->second = std::min(added->second, here_m);
    }
    if (sessions.size() == 1) continue;
    for (const LandmarkObservation& observation : landmark.observations) {
      for (const auto& [session, least_m] : sessions) {
        const auto added = tied[observation.image].emplace(session, least_m).first;
        if (session != sessionOf(observation.image)) added->second = std::min(added->second, least_m);
      }
    }
  }
  return tied;
}

/// Of the believed fixes of a session from the adjusted path. Its bias is left in.
std::vector<FixResidual> Reconstruction::fixResiduals(std::size_t session) const {
  const UnadjustedSession& of = *sessions_[session];
  const double delay_s = problem_.sessions[session].fix_delay_s;
  std::vector<FixResidual> residuals;
  for (const FixAtImage& fix : fixesAtImages(of.images, of.fixes, sigmaOfUndeclared_m(config_))) {
    if (!fix.believed) continue;
    const std::size_t image = begin(session) + fix.image;
    const Eigen::Vector3d antenna_m = antennaInMap_m(problem_.cameras[image], image);
    residuals.push_back({secondsBetween(of.images.front().stamp_ns, fix.stamp_ns),
                         fix.position_m + delay_s * fix.velocity_m_s - antenna_m.head<2>(), fix.sigma_m});
  }
  return residuals;
}

void Reconstruction::findBudget() {
  FixBudget& budget = budgets_.front();
  budget = withoutClaims(fixBudget(fixResiduals(0), shared_.position_m), sessions_.front()->fixes, config_);
  if (budget.declared_m == 0.0) budget.sigma_m = budget.declared_m = sigmaOfUndeclared_m(config_);  // no fixes
  budget.sigma_m = std::max(budget.sigma_m, kLeastSigma_m);
}

/// Of those sessions that see something together.
CommonBudget Reconstruction::commonBudgetOf(const std::vector<TiedSessions>& tied) const {
  std::vector<bool> is_tied(sessions_.size());
  for (const TiedSessions& together : tied) {
    for (const auto& [session, doubt_m] : together) is_tied[session] = is_tied[session] || together.size() > 1;
  }
  std::vector<TiedBudget> budgets;
  for (std::size_t k = 0; k < sessions_.size(); ++k) {
    if (!is_tied[k]) continue;
    std::vector<Eigen::Vector3d> off_m;
    for (const FixResidual& fix : fixResiduals(k)) off_m.emplace_back(fix.off_m.x(), fix.off_m.y(), 0.0);
    const std::vector<TrajectoryPoint>& images = sessions_[k]->images;
    budgets.push_back({budgets_[k], off_m.empty() ? Eigen::Vector2d::Zero().eval() : medianOf(off_m).head<2>().eval(),
                       secondsBetween(0, images.front().stamp_ns), secondsBetween(0, images.back().stamp_ns)});
  }
  const CommonBudget of_tied = commonBudget(budgets);
  CommonBudget common{std::vector<std::size_t>(sessions_.size()), of_tied.stretch};
  std::size_t next = 0;
  for (std::size_t k = 0; k < sessions_.size(); ++k) {
    if (is_tied[k]) common.receivers[k] = of_tied.receivers[next++];
  }
  return common;
}

/// Receivers err each by itself: where several are tied, their errors average out. Where no fix confirms the path,
/// images stray from it.
double Reconstruction::mapSigma_m(const TiedSessions& tied, const CommonBudget& common) const {
  const double stretch = tied.size() > 1 ? common.stretch : 1.0;
  std::map<std::size_t, double> information;  // of each receiver
  for (const auto& [session, doubt_m] : tied) {
    const double bias_m = std::max(stretch * budgets_[session].sigma_m, kLeastSigma_m);
    double& best = information[common.receivers[session]];
    best = std::max(best, 1.0 / (bias_m * bias_m + doubt_m * doubt_m));
  }
  double sum = 0.0;
  for (const auto& [receiver, of_receiver] : information) sum += of_receiver;
  return 1.0 / std::sqrt(sum);
}

ImageGeometry Reconstruction::imageAt(std::size_t image, double sigma_m) const {
  ImageGeometry geometry;
  geometry.camera = problem_.cameras[image];
  Eigen::Matrix<double, 6, 1> sigmas;
  sigmas << sigma_m, sigma_m, sigma_m, kAttitudeSigma_rad, kAttitudeSigma_rad, kAttitudeSigma_rad;
  geometry.covariance = sigmas.cwiseAbs2().asDiagonal();
  return geometry;
}

/// Of each image from where the believed fix at it has it.
std::vector<std::optional<Eigen::Vector2d>> Reconstruction::offFixes_m() const {
  std::vector<std::optional<Eigen::Vector2d>> off_m(images_.size());
  for (const PositionObservation& fix : fixes_) {
    if (!fix.believed) continue;
    const BundleSession& session = problem_.sessionOf(fix.image);
    const Eigen::Vector2d then_m = fix.east_north_m + session.fix_delay_s * fix.velocity_m_s - session.fix_bias_m;
    off_m[fix.image] = then_m - antennaInMap_m(problem_.cameras[fix.image], fix.image).head<2>();
  }
  return off_m;
}

/// The same in sigmas of the fixes.
std::vector<std::optional<double>> Reconstruction::distancesOffFixes() const {
  const std::vector<std::optional<Eigen::Vector2d>> off_m = offFixes_m();
  std::vector<std::optional<double>> distances(images_.size());
  for (const PositionObservation& fix : fixes_) {
    if (off_m[fix.image]) distances[fix.image] = off_m[fix.image]->norm() / fix.sigma_m;
  }
  return distances;
}

/// By how much more than their poses the images turn to the left, from those before to each.
std::vector<std::optional<double>> Reconstruction::turnsOffImages_rad() const {
  std::vector<double> sum_rad(images_.size());
  std::vector<std::optional<double>> turned_rad(images_.size());
  std::vector<std::vector<const RelativeRotation*>> pairs(images_.size());
  for (const RelativeRotation& pair : relative_) pairs[pair.b].push_back(&pair);
  for (std::size_t i = 1; i < images_.size(); ++i) {
    std::vector<double> sums_rad;
    for (const RelativeRotation* pair : pairs[i]) {
      const Eigen::Quaterniond by_images = problem_.cameras[pair->a].rotation * pair->b_from_a.conjugate();
      const Eigen::Matrix3d more = (by_images * problem_.cameras[i].rotation.conjugate()).toRotationMatrix();
      sums_rad.push_back(sum_rad[pair->a] + std::atan2(more(1, 0), more(0, 0)));
    }
    sum_rad[i] = sums_rad.empty() ? sum_rad[i - 1] : median(sums_rad);
    if (!sums_rad.empty()) turned_rad[i] = sum_rad[i] - sum_rad[i - 1];
  }
  return turned_rad;
}

/// Of each session.
std::vector<std::vector<PathEvidence>> Reconstruction::evidence() const {
  const std::vector<std::optional<Eigen::Vector2d>> off_m = offFixes_m();
  const std::vector<std::optional<double>> turned_rad = turnsOffImages_rad();
  const std::vector<std::optional<double>> explained = explainedShares();
  std::vector<std::vector<PathEvidence>> paths(sessions());
  for (std::size_t i = 0; i < images_.size(); ++i) {
    // One that is astray comes into no map, and would bend the path.
    const Eigen::Vector3d at_m =
        isAstray(i, explained[i]) ? (startOf_m(i) + usualShift_m(i)).eval() : antennaInMap_m(problem_.cameras[i], i);
    PathEvidence at{images_[i].cleaned.stamp_ns, at_m.head<2>()};
    at.turned_rad = turned_rad[i];
    if (off_m[i]) {
      std::vector<Eigen::Vector3d> around_m;
      for (const std::size_t neighbour : neighboursOf(i)) {
        if (off_m[neighbour]) around_m.emplace_back(off_m[neighbour]->x(), off_m[neighbour]->y(), 0.0);
      }
      at.off_fixes_m = medianOf(around_m).head<2>();
    }
    paths[sessionOf(i)].push_back(at);
  }
  for (const PositionObservation& fix : fixes_) {
    const std::uint32_t session = sessionOf(fix.image);
    paths[session][fix.image - begin(session)].fix_sigma_m = fix.sigma_m / kFixCorrelation;
  }
  return paths;
}

/// The median around an image: one fix may err.
std::optional<double> Reconstruction::usual(const std::vector<std::optional<double>>& values, std::size_t image) const {
  std::vector<double> around;
  for (const std::size_t neighbour : neighboursOf(image)) {
    if (values[neighbour]) around.push_back(*values[neighbour]);
  }
  return around.empty() ? std::nullopt : std::optional<double>(median(around));
}

/// Images with enough landmarks, and how far they were moved. Those around which most of what was matched fits nowhere
/// get none: their places stay.
void Reconstruction::addPath(std::vector<ImageGeometry> images, std::vector<SessionGeometry>& geometries) const {
  const std::vector<std::optional<double>> off_fixes = distancesOffFixes();
  const std::vector<std::optional<double>> explained = explainedShares();
  std::vector<std::size_t> trackable(geometries.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    SessionGeometry& geometry = geometries[sessionOf(i)];
    std::optional<ImageGeometry>& image = geometry.images.emplace_back();
    if (explained[i]) ++trackable[sessionOf(i)];
    if (images[i].landmarks.size() < kMinLandmarks || isAstray(i, explained[i])) continue;
    const bool is_off = usual(off_fixes, i).value_or(0.0) > kOffFixes;
    const bool is_unexplained = usual(explained, i).value_or(1.0) < kLeastExplained;
    if (is_off) ++geometry.off_fixes;
    if (is_unexplained) ++geometry.unexplained;
    if (is_unexplained) continue;
    image = std::move(images[i]);
    std::sort(image->landmarks.begin(), image->landmarks.end(),
              [](const SeenLandmark& a, const SeenLandmark& b) { return a.feature < b.feature; });
    ++geometry.located;
    const double shift_m = shiftOf_m(i).head<2>().norm();
    geometry.mean_shift_m += shift_m;
    geometry.largest_shift_m = std::max(geometry.largest_shift_m, shift_m);
  }
  for (std::size_t k = 0; k < geometries.size(); ++k) {
    SessionGeometry& geometry = geometries[k];
    if (geometry.located > 0) geometry.mean_shift_m /= static_cast<double>(geometry.located);
    // A third of the images lie elsewhere (of mirrored fixes two in five, of good recordings at most one in eight), or
    // most of those that match each other have no place where their matches fit.
    geometry.contradicts_fixes = 3 * geometry.off_fixes > geometry.located || 2 * geometry.located < trackable[k];
  }
}

namespace {

constexpr std::size_t kLeastShared = 8;  ///< landmarks of both that say where one is beside the other
constexpr std::size_t kWindow = 10;      ///< images on each side whose ties count for an image

/// What a tie says about the session of an image.
struct Offset {
  std::size_t image;  ///< within its session
  Eigen::Vector3d shift_m;
};

/// From the landmarks of image b to those of image a: the median over their matches.
std::optional<Eigen::Vector3d> offset(const SeenLandmarks& landmarks, const ImagePair& pair) {
  std::vector<Eigen::Vector3d> differences;
  for (const FeatureMatch& match : pair.matches) {
    const Landmark* a = landmarks.at({pair.a, match.a});
    const Landmark* b = landmarks.at({pair.b, match.b});
    if (a != nullptr && b != nullptr) differences.push_back(a->position_m - b->position_m);
  }
  if (differences.size() < kLeastShared) return std::nullopt;
  return medianOf(differences);
}

/// The median of the ties near each image, or else the nearest one. `offsets`: in order of the image, one at least.
std::vector<Eigen::Vector3d> shiftsAlong(std::size_t images, const std::vector<Offset>& offsets) {
  const auto from = [&offsets](std::size_t image) {
    return std::lower_bound(offsets.begin(), offsets.end(), image,
                            [](const Offset& offset, std::size_t i) { return offset.image < i; });
  };
  std::vector<Eigen::Vector3d> shifts_m;
  for (std::size_t i = 0; i < images; ++i) {
    std::vector<Eigen::Vector3d> near;
    for (auto offset = from(i - std::min(i, kWindow)); offset != offsets.end() && offset->image <= i + kWindow;
         ++offset) {
      near.push_back(offset->shift_m);
    }
    if (near.empty()) {
      const auto after = from(i);
      const auto before = after == offsets.begin() ? after : from(std::prev(after)->image);
      const bool later = after != offsets.end() && (before == after || after->image - i < i - before->image);
      near.push_back((later ? after : before)->shift_m);
    }
    shifts_m.push_back(medianOf(near));
  }
  return shifts_m;
}

/// Where the images of a session stand in the order of those before it, `places`: by their ties, or else as the image
/// before; behind all others without any.
std::vector<double> placesAlong(std::size_t begin, std::size_t images, const std::vector<ImagePair>& ties,
                                const std::vector<double>& places) {
  std::vector<std::vector<double>> tied(images);
  for (const ImagePair& tie : ties) {
    if (tie.a < begin && tie.b >= begin && tie.b < begin + images) tied[tie.b - begin].push_back(places[tie.a]);
  }
  const auto first = std::find_if(tied.begin(), tied.end(), [](const auto& here) { return !here.empty(); });
  double place = first == tied.end() ? static_cast<double>(begin) : median(*first);
  std::vector<double> along;
  for (const std::vector<double>& here : tied) {
    if (!here.empty()) place = median(here);
    along.push_back(place);
  }
  return along;
}

}  // namespace

void Reconstruction::orderBy(const std::vector<ImagePair>& ties) {
  std::vector<double> places;
  for (std::size_t session = 0; session < sessions_.size(); ++session) {
    const std::vector<double> along = placesAlong(begin(session), imagesIn(session), ties, places);
    places.insert(places.end(), along.begin(), along.end());
    if (session > 0) continue;
    std::iota(places.begin(), places.end(), 0.0);
  }
  std::vector<std::size_t> order(images_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return places[a] < places[b]; });
  for (std::size_t rank = 0; rank < order.size(); ++rank) ranks_[order[rank]] = rank;
}

std::vector<double> alignSessions(const std::vector<ImagePair>& ties, Reconstruction& reconstruction) {
  const SeenLandmarks landmarks(reconstruction.landmarks());  // moves with them
  std::vector<double> apart_m(reconstruction.sessions(), 0.0);
  for (std::size_t session = 1; session < apart_m.size(); ++session) {
    const std::size_t begin = reconstruction.begin(session);
    std::vector<Offset> offsets;
    std::vector<double> lengths_m;
    for (const ImagePair& tie : ties) {
      if (reconstruction.sessionOf(tie.b) != session) continue;
      const auto shift_m = offset(landmarks, tie);
      if (!shift_m) continue;
      offsets.push_back({tie.b - begin, *shift_m});
      lengths_m.push_back(shift_m->norm());
    }
    if (offsets.empty()) continue;
    apart_m[session] = median(lengths_m);
    reconstruction.move(session, shiftsAlong(reconstruction.imagesIn(session), offsets));
  }
  return apart_m;
}

}  // namespace visual_localization
