#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/bundle_adjustment.h"
#include "geometry/feature_tracks.h"
#include "geometry/fix_budget.h"
#include "geometry/heading_offset.h"
#include "geometry/path_doubts.h"
#include "geometry/pose_solver.h"
#include "geometry/rays.h"
#include "geometry/relative_rotation.h"
#include "geometry/session_geometry.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geometry/image_geometry.h"

namespace visual_localization {

/// A fix, moved along the cleaned path to the moment of the image that it is nearest to.
struct FixAtImage {
  std::uint32_t image = 0;
  std::int64_t stamp_ns = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double sigma_m = 0.0;                                    ///< per axis, 2 cm to 10 m
  Eigen::Vector2d velocity_m_s = Eigen::Vector2d::Zero();  ///< along that path
  bool believed = true;
};

/// Of those around each image (nearer to it than to the next image, half a second at most), in order of time; `sigma_m`
/// for fixes without one.
std::vector<FixAtImage> fixesAtImages(const std::vector<TrajectoryPoint>& images, const std::vector<MapFix>& fixes,
                                      double sigma_m);

/// Where the fixes have each image: the median of fixesAtImages(), axis by axis, and of their sigmas, and the velocity
/// along that path; of those alone that are believed, if there are any. Images without such fixes have none.
std::vector<PositionObservation> positionsAt(const std::vector<TrajectoryPoint>& images,
                                             const std::vector<MapFix>& fixes, double sigma_m);

/// How a road rises and falls under the images of a session.
struct PathHeights {
  std::vector<double> up_m;   ///< of each image, above that of the first one
  std::vector<double> slope;  ///< of each image, rise over run in the direction of travel
  double sigma_m = 0.0;       ///< median standard deviation of a fix's altitude
  bool measured = false;      ///< otherwise all is level
};

/// By the altitudes of the fixes near the cleaned path: a line through those within 20 m along the path, for each image
/// (least squares; roads are not steep). Level without altitudes, when all are the same (the receiver measures none),
/// or when there are images that none is near.
PathHeights pathHeights(const std::vector<TrajectoryPoint>& images, const std::vector<MapFix>& fixes);

/// Images of one session or several, and what they show, while they are adjusted.
class Reconstruction {
 public:
  /// Fixes err alike for many images: the sigma of the position of one is this multiple of a fix's, as if about ten
  /// images (3.3 squared) shared one error.
  static constexpr double kFixCorrelation = 3.3;
  /// Scale of the loss of a fix, in sigmas. Believed fixes have Cauchy's; of the others, whose loss is Geman and
  /// McClure's, one that is much farther off has no influence.
  static constexpr double kFixLoss = 1.0;
  static constexpr double kMaxResidual = 5.0;  ///< sigmas between a landmark and what shows it: no chance goes so far
  static constexpr std::size_t kMinViews = 3;  ///< of a landmark, in the end
  static constexpr std::size_t kEnoughTracked = 20;  ///< features of an image, for their share to say anything
  static constexpr std::size_t kMinLandmarks = 12;   ///< an image with fewer has a place only
  static constexpr double kBelievedFix_m = 1.0;      ///< from the cleaned path, of a fix that confirms it

  explicit Reconstruction(const GeometryConfig& config) : config_(config) { problem_.lenses.clear(); }

  /// Appends the images of a session, where the cleaned path has their antenna, and what they show. `session` must
  /// outlive it. `relative`: what neighbours say of each other; `directions`: see drivingDirections().
  void add(const UnadjustedSession& session, std::vector<KeypointRays> rays, const AveragedRotations& rotations,
           const std::vector<RelativeRotation>& relative, const std::vector<double>& directions,
           const FeatureSets& sets);
  /// Appends those of another one, with its landmarks, as they are there.
  void append(const Reconstruction& other);

  std::size_t size() const { return images_.size(); }
  std::size_t sessions() const { return sessions_.size(); }
  /// The first image of a session, and how many it has.
  std::size_t begin(std::size_t session) const { return problem_.sessions[session].begin; }
  std::size_t imagesIn(std::size_t session) const { return sessions_[session]->images.size(); }
  /// The session as it came.
  const UnadjustedSession& session(std::size_t session) const { return *sessions_[session]; }
  std::uint32_t sessionOf(std::size_t image) const { return images_[image].session; }
  const KeypointRays& rays(std::size_t image) const { return images_[image].rays; }
  double focal_px(std::size_t image) const { return lensOf(images_[image].session).fx; }
  /// As the images have it so far.
  Intrinsics lensOf(std::size_t session) const;
  const LensCorrection& lensCorrection(std::size_t session) const;
  const TrajectoryPoint& cleaned(std::size_t image) const { return images_[image].cleaned; }
  const CameraPose& camera(std::size_t image) const { return problem_.cameras[image]; }
  const std::vector<Landmark>& landmarks() const { return problem_.landmarks; }

  /// Moves the images of a session, and the landmarks that they were the first to see.
  void move(std::size_t session, const std::vector<Eigen::Vector3d>& shifts_m);
  /// From now on landmarks come from these matches as well, and windows have images of later sessions together with
  /// those that they are tied to.
  void tie(const std::vector<ImagePair>& ties);
  /// Fixes count from now on: all of them, or those that are at most `farthest_m` from the cleaned path. `loss`: scale
  /// of their robust loss, sigmas.
  void useFixes(double farthest_m, double loss);
  /// Landmarks from tracks, anew; of tracks cut into pieces of at most `max_views`. Observations farther than `gate_px`
  /// from their landmark are left out.
  void triangulateAll(double gate_px, std::size_t max_views);
  /// Adjusts everything, window by window, then drops observations that disagree and landmarks that fewer than
  /// `min_views` images see.
  void adjustAndPrune(double tolerance, std::size_t min_views);
  void moveAsOne();
  /// Images where little of what they match fits start again where the landmarks of others have them, and so on from
  /// Whether landmarks explain too little of most images.
  bool mostAreLost() const;
  /// there: fixes that are metres off let no landmark begin beside them. `gate_px`, `max_views`: see triangulateAll().
  void resect(double gate_px, std::size_t max_views);
  /// A single image may end in a minimum of its own, metres off. It starts again among its neighbours.
  void restartAmongNeighbours();
  /// From now on the calibrations are adjusted as well. `sigma`: what is known of each entry before.
  void freeLenses(const LensCorrection& sigma) { bundle_.lens_sigma = sigma; }
  /// Entries of the lenses that the images do not change significantly keep their published values from now on (the
  /// focal length only if one was published), and the delay of the fixes stays 0.
  void keepSignificant(bool focal_is_known);
  /// By keepSignificant(); zero for what is held.
  const SharedSigmas& sigmas() const { return shared_; }
  /// Finds what errors of the receiver may have left in a single session, which has been adjusted.
  void findBudget();
  /// Headings of the robot of a single session, by the mounting as it was adjusted, at images that it drives between.
  std::vector<DrivenHeading> drivenHeadings() const;
  /// What it came to, session by session; landmark ids begin with `first_id`.
  std::vector<SessionGeometry> results(std::uint32_t first_id) const;

 private:
  struct Image {
    std::uint32_t session = 0;
    TrajectoryPoint cleaned;
    KeypointRays rays;
    Eigen::Quaterniond start;  ///< rotation before the adjustment
    double up_m = 0.0;         ///< by altitudes, above the first one of its session; 0 without any
  };

  /// Sessions that know where a place is, and what the test of their paths leaves open there, metres.
  using TiedSessions = std::map<std::uint32_t, double>;

  void orderBy(const std::vector<ImagePair>& ties);
  Eigen::Vector3d antennaInMap_m(const CameraPose& camera, std::size_t image) const;
  Eigen::Vector3d startOf_m(std::size_t image) const;
  Eigen::Vector3d shiftOf_m(std::size_t image) const;
  Eigen::Vector3d turnOf_rad(std::size_t image) const;
  std::vector<std::size_t> neighboursOf(std::size_t image) const;
  Eigen::Vector3d usualShift_m(std::size_t image) const;
  Eigen::Vector3d usualTurn_rad(std::size_t image) const;
  bool isAstray(std::size_t image, const std::optional<double>& explained) const;
  std::vector<std::optional<double>> explainedShares() const;
  std::vector<bool> lostImages() const;
  std::vector<std::vector<LandmarkMatch>> landmarksOf(const std::vector<bool>& some) const;
  void triangulateWithout(const std::vector<bool>& left_out, double gate_px, std::size_t max_views);
  double distance_m(const Landmark& landmark) const;
  std::vector<TiedSessions> tiedSessions(const std::vector<std::vector<PathDoubt>>& doubts) const;
  CommonBudget commonBudgetOf(const std::vector<TiedSessions>& tied) const;
  double mapSigma_m(const TiedSessions& tied, const CommonBudget& common) const;
  ImageGeometry imageAt(std::size_t image, double sigma_m) const;
  void addLandmark(const FeatureTrack& track, double gate_px);
  std::size_t addLens(const BundleLens& lens);
  void adjustWindows();
  void adjustLenses(const std::vector<BundleWindow>& windows);
  void applyLenses(std::size_t first_session);
  SharedSigmas sharedSigmasNow() const;
  std::vector<BundleWindow> windows() const;
  BundleProblem problemOf(const BundleWindow& window) const;
  bool isWithin(double farthest_m, const PositionObservation& fix) const;
  std::vector<std::optional<double>> turnsOffImages_rad() const;
  std::vector<std::vector<PathEvidence>> evidence() const;
  std::vector<std::optional<Eigen::Vector2d>> offFixes_m() const;
  std::vector<std::optional<double>> distancesOffFixes() const;
  std::vector<FixResidual> fixResiduals(std::size_t session) const;
  std::optional<double> usual(const std::vector<std::optional<double>>& values, std::size_t image) const;
  void addPath(std::vector<ImageGeometry> images, std::vector<SessionGeometry>& geometries) const;

  const GeometryConfig& config_;
  BundleConfig bundle_;
  std::vector<const UnadjustedSession*> sessions_;
  std::vector<FixBudget> budgets_;  ///< of each session
  std::vector<Image> images_;
  std::vector<PositionObservation> fixes_;  ///< all of them
  std::vector<RelativeRotation> relative_;  ///< of neighbours
  FeatureSets sets_;                        ///< of what the images show
  BundleProblem problem_;
  std::vector<std::size_t> ranks_;  ///< of the images, in windows
  SharedSigmas shared_;
};

/// Moves each session of `reconstruction` to where those before it have what both see: its landmarks beside theirs, by
/// the matches in `ties`. The shift follows the path, since fixes err another way from one stretch to the next. Returns
/// how far each session was from the ones before, metres: the median over its ties; 0 without any.
std::vector<double> alignSessions(const std::vector<ImagePair>& ties, Reconstruction& reconstruction);

}  // namespace visual_localization
