#include "geometry/session_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/numbers.h"
#include "base/parallel.h"
#include "geometry/feature_tracks.h"
#include "geometry/rays.h"
#include "geometry/reconstruction.h"
#include "geometry/relative_rotation.h"

namespace visual_localization {
namespace {

constexpr double kMaxTurn_rad = 0.6;  ///< from one image to the next
constexpr double kMaxRevisitTurn_rad = 0.8;
constexpr double kTurned_rad = 0.17;  ///< of a camera that nobody described: beyond that it is not level and ahead
constexpr std::uint32_t kRotationSpan = 3;  ///< images farther apart say little about each other's rotation
constexpr double kContradiction = 3.0;      ///< sigmas of a calibration, beyond which it is none of this camera
constexpr double kAllFixes_m = std::numeric_limits<double>::infinity();
/// Relative changes of the cost at which adjustments end. The whole path turns and shifts along a flat valley of the
/// cost: thousands of observations hardly feel it. One that ends early leaves it metres off where the camera looks
/// aside or the road climbs, so only those may that another one follows.
constexpr double kRough = 1e-3;
constexpr double kCoarse = 1e-4;
constexpr double kFine = 1e-6;
constexpr double kUnknownFocal = 0.3;       ///< one sigma of the logarithm of a focal length that nobody calibrated
constexpr double kAspectSigma = 0.002;      ///< of square pixels
constexpr double kStretchedAspect = 0.005;  ///< likewise, where the shutter of a camera that moves stretches them
constexpr std::uint32_t kPairSpan = 8;      ///< each image is matched with so many of the next ones
/// Landmarks that many images show tie all of these to each other, which costs time. Until positions are about right
/// their tracks are cut.
constexpr std::size_t kCoarseViews = 20;
constexpr std::size_t kAllViews = std::numeric_limits<std::size_t>::max();
constexpr double kCoarseLoss = 5.0;  ///< the same for the loss of fixes, in sigmas: no fix is without influence yet

using Indices = std::pair<std::uint32_t, std::uint32_t>;

LensCorrection lensSigmaOf(const GeometryConfig& config) {
  LensCorrection sigma;
  sigma << config.focal_sigma, kAspectSigma, config.principal_point_sigma, config.principal_point_sigma,
      config.distortion_sigma, config.distortion_sigma;
  return sigma;
}

/// Two images, and what they agree on.
struct Pair {
  ImagePair matches;
  std::optional<TwoView> view;
};

/// Matches and verifies pairs of images.
class PairMatcher {
 public:
  PairMatcher(const GeometryConfig& config, std::size_t threads) : config_(config), threads_(threads) {}

  /// Calls `use` with those pairs that agree on enough, in their order. `viewOf(i)`: features and rays of an image.
  template <class ViewOf, class Use>
  void match(const std::vector<Indices>& indices, const ViewOf& viewOf, const Use& use) const {
    std::vector<Pair> pairs;
    for (std::size_t begin = 0; begin < indices.size(); begin += pairs.size()) {
      pairs.assign(std::min(kAtOnce, indices.size() - begin), {});
      parallelFor(pairs.size(), threads_, [&](std::size_t i) {
        const auto [a, b] = indices[begin + i];
        pairs[i].matches = {a, b, {}};
        verify(viewOf(a), viewOf(b), pairs[i]);
      });
      for (Pair& pair : pairs) {
        if (pair.view) use(pair);
      }
    }
  }

  struct View {
    std::shared_ptr<const LocalFeatures> features;
    const LocalFeatureKind* kind;
    const KeypointRays* rays;
    double focal_px;
  };

 private:
  void verify(const View& a, const View& b, Pair& pair) const {
    std::vector<FeatureMatch> matches;
    a.kind->correspond(*a.features, *b.features, PairRule::kMatchRatio, matches);
    const std::uint32_t apart = pair.matches.b - pair.matches.a;
    const double turn_rad = apart <= kPairSpan ? kMaxTurn_rad * apart : kMaxRevisitTurn_rad;
    pair.view =
        verifyTwoViews(a.rays->normalised, b.rays->normalised, usable(matches, *a.rays, *b.rays),
                       PairRule::kTolerance_px / std::min(a.focal_px, b.focal_px), PairRule::kMinInliers, turn_rad);
    if (pair.view) pair.matches.matches = std::move(pair.view->inliers);
  }

  static constexpr std::size_t kAtOnce = 4096;  ///< pairs whose matches are in memory

  const GeometryConfig& config_;
  std::size_t threads_;
};

/// A session on its own.
class SessionAdjuster {
 public:
  SessionAdjuster(UnadjustedSession& session, const GeometryConfig& config, const LensCorrection& lens_sigma,
                  std::size_t threads)
      : session_(session),
        config_(config),
        lens_sigma_(lens_sigma),
        matcher_(config, threads),
        reconstruction_(config) {
    start();
    adjust();
  }

  /// Of a single session; landmark ids begin with `first_id`.
  SessionGeometry result(std::uint32_t first_id) const {
    SessionGeometry geometry = std::move(reconstruction_.results(first_id).front());
    if (tells_mounting_) geometry.found_camera = foundCamera(geometry.mounting_rad);
    const LensCorrection& lens = reconstruction_.lensCorrection(0);
    LensCorrection known = lens_sigma_;
    known[kAspect] = kStretchedAspect;
    geometry.lens_sigmas = lens.cwiseQuotient(known);
    geometry.contradicts_calibration = (geometry.lens_sigmas.array().abs() > kContradiction).any();
    return geometry;
  }
  const Reconstruction& reconstruction() const { return reconstruction_; }

 private:
  /// Of images that may show the same.
  std::vector<Indices> pairs() const {
    const auto count = static_cast<std::uint32_t>(session_.images.size());
    std::vector<Indices> indices;
    for (std::uint32_t a = 0; a < count; ++a) {
      for (std::uint32_t b = a + 1; b < count && b <= a + kPairSpan; ++b) indices.emplace_back(a, b);
    }
    std::vector<PathImage> path;
    for (const TrajectoryPoint& image : session_.images) path.push_back({0, image});
    for (const Indices& pair : revisits(path)) indices.push_back(pair);
    return indices;
  }

  void start() {
    std::vector<KeypointRays> rays;
    FeatureSets sets;
    for (std::size_t i = 0; i < session_.images.size(); ++i) {
      rays.push_back(raysOf(*session_.features(i), *session_.camera));
      sets.addImage(rays.back().normalised.size());
    }
    std::vector<RelativeRotation> relative;
    const auto view = [&](std::uint32_t i) {
      return PairMatcher::View{session_.features(i), session_.kind.get(), &rays[i], session_.camera->intrinsics().fx};
    };
    matcher_.match(pairs(), view, [&](const Pair& pair) {
      const auto& [a, b, inliers] = pair.matches;
      if (b - a <= kRotationSpan) relative.push_back({a, b, pair.view->b_from_a, pair.view->travel});
      sets.join(pair.matches);
    });
    std::vector<double> yaws_rad;
    for (const TrajectoryPoint& image : session_.images) yaws_rad.push_back(image.yaw_rad);
    const std::vector<double> directions = drivingDirections(yaws_rad, relative);
    for (std::size_t i = 0; i < yaws_rad.size(); ++i) yaws_rad[i] += directions[i] < 0.0 ? kPi : 0.0;
    if (session_.finds_mount) findMounting(yaws_rad, directions, relative);
    // Level, whatever the altitudes say: a camera turned aside by much would explain how a robot leans across a slope.
    const AveragedRotations rotations = averageRotations(yaws_rad, relative, mountingOf(session_.mount));
    reconstruction_.add(session_, std::move(rays), rotations, relative, directions, sets);
  }

  /// What is nearly level and ahead the adjustment finds by itself.
  void findMounting(const std::vector<double>& headings_rad, const std::vector<double>& directions,
                    const std::vector<RelativeRotation>& relative) {
    const Eigen::Quaterniond level = levelCamera(0.0);
    const auto found = mountingByImages(headings_rad, directions, relative);
    tells_mounting_ = found.has_value();
    is_turned_ = found && found->angularDistance(level) > kTurned_rad;
    session_.mount.camera.rotation = is_turned_ ? *found : level;
  }

  /// Its yaw by where the robot drives. Who mounts a camera wants it to look ahead, aside or back: that is its yaw
  /// unless the drive says significantly otherwise. Nothing for one that is level and ahead as far as can be told.
  std::optional<CameraPose> foundCamera(const Eigen::Vector3d& mounting_rad) const {
    constexpr double kSignificant = 3.0;  // sigmas
    constexpr double kRightAngle_rad = 0.5 * kPi;
    constexpr double kLevel = 0.7;
    CameraPose camera{levelCamera(0.0) * Eigen::Quaterniond(exponential(mounting_rad)), {0.0, 0.0, 0.0}};
    const HeadingOffset offset = headingOffset(reconstruction_.drivenHeadings());
    const double yaw_rad = camera.yaw_rad() + offset.yaw_rad;
    const double off_rad = std::remainder(yaw_rad, kRightAngle_rad);
    const bool looks_down = camera.ahead().head<2>().norm() < kLevel;  // or up, and has no yaw to speak of
    const bool is_significant =
        looks_down || std::abs(off_rad) > std::min(kSignificant * offset.sigma_rad, kTurned_rad);
    if (is_turned_) {
      const double correction_rad = offset.yaw_rad - (is_significant ? 0.0 : off_rad);
      camera.rotation = Eigen::AngleAxisd(correction_rad, Eigen::Vector3d::UnitZ()) * camera.rotation;
      return camera;
    }
    if (!is_significant) return std::nullopt;
    return CameraPose{levelCamera(yaw_rad), {0.0, 0.0, 0.0}};
  }

  /// Coarse positions first, so the first landmarks are off by many pixels; then again from what that came to.
  void adjust() {
    reconstruction_.useFixes(Reconstruction::kBelievedFix_m, kCoarseLoss);
    reconstruction_.triangulateAll(20.0, kCoarseViews);
    reconstruction_.adjustAndPrune(kRough, 2);
    if (reconstruction_.mostAreLost()) {  // far off as well, yet nearer
      reconstruction_.triangulateAll(20.0, kCoarseViews);
      reconstruction_.adjustAndPrune(kCoarse, 2);
    }
    reconstruction_.resect(20.0, kCoarseViews);
    reconstruction_.restartAmongNeighbours();
    reconstruction_.useFixes(kAllFixes_m, Reconstruction::kFixLoss);
    reconstruction_.freeLenses(lens_sigma_);
    reconstruction_.triangulateAll(4.0, kCoarseViews);
    reconstruction_.adjustAndPrune(kCoarse, 2);
    reconstruction_.resect(4.0, kCoarseViews);
    reconstruction_.restartAmongNeighbours();
    reconstruction_.moveAsOne();
    reconstruction_.triangulateAll(4.0, kAllViews);
    reconstruction_.adjustAndPrune(kRough, 2);
    reconstruction_.keepSignificant(lens_sigma_[kFocalLength] < kUnknownFocal);
    reconstruction_.moveAsOne();
    reconstruction_.adjustAndPrune(kFine, Reconstruction::kMinViews);
    reconstruction_.findBudget();
  }

  UnadjustedSession& session_;
  const GeometryConfig& config_;
  const LensCorrection lens_sigma_;
  PairMatcher matcher_;
  Reconstruction reconstruction_;
  bool tells_mounting_ = false;  ///< the drive does
  bool is_turned_ = false;       ///< far from a level camera that looks ahead
};

/// Sessions that were adjusted on their own, tied to each other where they overlap.
class SessionTier {
 public:
  SessionTier(const GeometryConfig& config, std::size_t threads)
      : config_(config), matcher_(config, threads), together_(config) {}

  void add(const SessionAdjuster& alone) { together_.append(alone.reconstruction()); }

  /// Nothing when no two sessions overlap; otherwise that of each session, in the order in which they were added.
  std::optional<std::vector<SessionGeometry>> run() {
    const std::vector<ImagePair> ties = matchTies();
    if (ties.empty()) return std::nullopt;
    const std::vector<double> apart_m = alignSessions(ties, together_);
    together_.tie(ties);
    together_.useFixes(kAllFixes_m, Reconstruction::kFixLoss);
    together_.triangulateAll(20.0, kCoarseViews);
    together_.adjustAndPrune(kRough, 2);
    together_.triangulateAll(4.0, kCoarseViews);
    together_.adjustAndPrune(kCoarse, 2);
    together_.adjustAndPrune(kFine, Reconstruction::kMinViews);
    std::vector<SessionGeometry> results = together_.results(0);
    for (std::size_t k = 0; k < results.size(); ++k) results[k].tied_apart_m = apart_m[k];
    return results;
  }

 private:
  std::vector<ImagePair> matchTies() const {
    std::vector<PathImage> path;
    for (std::size_t i = 0; i < together_.size(); ++i) {
      TrajectoryPoint at = together_.cleaned(i);
      at.position_m = together_.camera(i).position_m.head<2>();
      path.push_back({together_.sessionOf(i), at});
    }
    std::vector<Indices> indices;
    for (const Indices& pair : revisits(path)) {
      if (path[pair.first].session != path[pair.second].session) indices.push_back(pair);
    }
    std::vector<ImagePair> ties;
    matcher_.match(
        indices, [this](std::uint32_t i) { return view(i); },
        [&ties](Pair& pair) { ties.push_back(std::move(pair.matches)); });
    return ties;
  }

  PairMatcher::View view(std::uint32_t image) const {
    const std::uint32_t session = together_.sessionOf(image);
    const UnadjustedSession& of = together_.session(session);
    return {of.features(image - together_.begin(session)), of.kind.get(), &together_.rays(image),
            together_.focal_px(image)};
  }

  const GeometryConfig& config_;
  PairMatcher matcher_;
  Reconstruction together_;
};

}  // namespace

std::vector<SessionGeometry> adjustSessions(std::vector<UnadjustedSession> sessions, const GeometryConfig& config,
                                            std::size_t threads) {
  std::vector<SessionGeometry> geometries;
  SessionTier tier(config, threads);
  std::vector<std::size_t> believed;
  std::uint32_t next_id = 0;
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    const SessionAdjuster alone(sessions[k], config, lensSigmaOf(config), threads);
    geometries.push_back(alone.result(next_id));
    if (geometries.back().contradicts_calibration || geometries.back().contradicts_fixes) continue;
    next_id += static_cast<std::uint32_t>(geometries.back().landmarks);
    tier.add(alone);
    believed.push_back(k);
  }
  auto tied = believed.size() > 1 ? tier.run() : std::nullopt;
  for (std::size_t i = 0; tied && i < believed.size(); ++i) {
    (*tied)[i].focal_sigma = geometries[believed[i]].focal_sigma;
    (*tied)[i].delay_sigma_s = geometries[believed[i]].delay_sigma_s;
    (*tied)[i].found_camera = geometries[believed[i]].found_camera;
    geometries[believed[i]] = std::move((*tied)[i]);
  }
  return geometries;
}

namespace {

constexpr double kUsual = 0.8;   ///< focal length as a share of the image's longer side: 64 degrees
constexpr double kBeyond = 1.3;  ///< where the second search begins, as a multiple of where the first one ended
constexpr double kWidest = 0.3;
constexpr double kLongest = 4.0;
constexpr int kMostSteps = 12;
constexpr double kSettled = 0.002;  ///< the last change of a search; or its sigma
constexpr double kSame = 3.0;       ///< sigmas between the ends of two searches

/// A focal length that images ask for.
struct Focal {
  double px = 0.0;
  double sigma = 0.0;  ///< of its logarithm
};

CameraModel pinhole(const cv::Size& size, double focal_px) {
  return CameraModel(
      {size, focal_px, focal_px, 0.5 * (size.width - 1), 0.5 * (size.height - 1), Distortion::kPlumbBob, {}});
}

/// Adjusts the session with one focal length after the other, each the one that the adjustment before asked for.
class FocalSearch {
 public:
  FocalSearch(UnadjustedSession& session, const cv::Size& size, const GeometryConfig& config, std::size_t threads)
      : session_(session), size_(size), config_(config), threads_(threads) {}

  /// Nothing when it does not settle.
  std::optional<Focal> from(double focal_px) const {
    const double longer_px = std::max(size_.width, size_.height);
    for (int step = 0; step < kMostSteps; ++step) {
      const Focal asked = askedFrom(focal_px);
      const double change = std::abs(std::log(asked.px / focal_px));
      focal_px = asked.px;
      if (!(focal_px >= kWidest * longer_px && focal_px <= kLongest * longer_px)) return std::nullopt;
      if (change <= std::max(kSettled, asked.sigma)) return asked;
    }
    return std::nullopt;
  }

 private:
  /// The focal length that an adjustment with this one asks for: still wrong where this one is far off.
  Focal askedFrom(double focal_px) const {
    const CameraModel camera = pinhole(size_, focal_px);
    session_.camera = &camera;
    LensCorrection sigma = lensSigmaOf(config_);
    sigma[kFocalLength] = kUnknownFocal;
    const SessionAdjuster adjuster(session_, config_, sigma, threads_);
    const double scale = std::exp(adjuster.reconstruction().lensCorrection(0)[kFocalLength]);
    return {focal_px * scale, adjuster.reconstruction().sigmas().lens[kFocalLength]};
  }

  UnadjustedSession& session_;
  const cv::Size& size_;
  const GeometryConfig& config_;
  std::size_t threads_;
};

}  // namespace

std::optional<CameraModel> calibrateByImages(UnadjustedSession session, const cv::Size& size,
                                             const GeometryConfig& config, std::size_t threads) {
  const FocalSearch search(session, size, config, threads);
  const double usual_px = kUsual * std::max(size.width, size.height);
  const std::optional<Focal> first = search.from(usual_px);
  if (!first) return std::nullopt;
  const std::optional<Focal> second = search.from(first->px * (first->px > usual_px ? kBeyond : 1.0 / kBeyond));
  if (!second) return std::nullopt;
  const double sigma = std::max(first->sigma, second->sigma);
  if (sigma > config.focal_sigma || std::abs(std::log(first->px / second->px)) > std::max(kSame * sigma, kSettled))
    return std::nullopt;
  return pinhole(size, std::sqrt(first->px * second->px));
}

void GeometryConfig::declare(ParameterVisitor& visitor) {
  visitor.flag({"geometry/enabled", "", "triangulate landmarks and adjust poses where the camera is calibrated"},
               enabled);
  visitor.flag({"geometry/self_calibration", "",
                "of a session without calibration find the focal length by its images; takes minutes"},
               self_calibration);
  visitor.real({"geometry/focal_sigma", "1", "how well a calibration knows the focal length, as a share of it"},
               focal_sigma, 1e-6, 1.0);
  visitor.real({"geometry/principal_point_sigma", "1", "and the principal point, as a share of the focal length"},
               principal_point_sigma, 1e-6, 1.0);
  visitor.real({"geometry/distortion_sigma", "1", "and the radial coefficients k1 and k2"}, distortion_sigma, 1e-6,
               1.0);
  visitor.real({"geometry/fix_sigma", "m",
                "standard deviation per axis of a fix that does not tell its own; 0: not known, so positions may be "
                "off by metres"},
               fix_sigma_m, 0.0, 100.0);
  visitor.real(
      {"geometry/spacing", "m",
       "of a session with landmarks keep, after all images were adjusted, only those at least this far from the "
       "last kept one"},
      spacing_m, 0.0, 1000.0);
}

}  // namespace visual_localization
