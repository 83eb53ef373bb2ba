#include "editing/map_alignment.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/numbers.h"
#include "base/parallel.h"
#include "localization/pose_verifier.h"

namespace visual_localization {
namespace {

bool isSame(const GeodeticPoint& a, const GeodeticPoint& b) {
  return a.latitude_deg == b.latitude_deg && a.longitude_deg == b.longitude_deg && a.altitude_m == b.altitude_m;
}

constexpr double kReach_m = 8.0;         ///< fixes of two recordings may be this far apart where they are at one place
constexpr std::size_t kNeighbours = 16;  ///< looked at for one that faces alike
constexpr std::size_t kImagesPerTask = 32;  ///< that share a verifier
constexpr double kTiedSession_m = 5.0;      ///< sessions of a map that are this close are tied to each other
constexpr double kLargestTurn_rad = 0.5;    ///< that a tie asks for
constexpr double kAgreeing_m = 0.5;         ///< a tie that is farther off after the alignment is wrong
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// A tie, and how well the other map knows where it is.
struct FoundTie {
  PoseTie tie;
  MapAlignment::Covariance map_covariance;
};

double turnBetween(const CameraPose& a, const CameraPose& b) { return a.rotation.angularDistance(b.rotation); }

class Aligner {
 public:
  Aligner(const TrainingMap& map, const LocalFrame& frame, const std::vector<PlacedMap>& placed)
      : map_(map), placed_(placed), camera_of_(map.size(), kNone) {
    const FrameChange change(map.frame(), frame);
    alignment_.covariances.resize(map.size());
    for (std::size_t i = 0; i < map.size(); ++i) {
      alignment_.corrections.push_back(change.at(map.position_m(i)));
      const auto geometry = map.geometry(i);
      if (!geometry) continue;
      camera_of_[i] = cameras_.size();
      images_.push_back(i);
      cameras_.push_back(alignment_.corrections[i].of(geometry->camera));
    }
    for (const PlacedMap& other : placed) back_.emplace_back(frame, other.map->frame());
  }

  MapAlignment run(std::size_t threads, const Progress& progress) {
    findTies(threads, progress);
    std::vector<PoseTie> ties;
    for (const FoundTie& found : ties_) ties.push_back(found.tie);
    if (ties.size() >= kLeastTied) accept(correctionsBy(ties, cameras_, neighbours()));
    return std::move(alignment_);
  }

 private:
  void findTies(std::size_t threads, const Progress& progress) {
    std::vector<std::vector<FoundTie>> found((images_.size() + kImagesPerTask - 1) / kImagesPerTask);
    parallelFor(
        found.size(), threads,
        [&](std::size_t task) {
          const std::size_t begin = task * kImagesPerTask;
          const std::size_t end = std::min(begin + kImagesPerTask, images_.size());
          for (std::size_t k = 0; k < placed_.size(); ++k) findTies(k, begin, end, found[task]);
        },
        progress);
    for (auto& of_task : found) ties_.insert(ties_.end(), of_task.begin(), of_task.end());
  }

  /// Of cameras [begin, end) with a placed map.
  void findTies(std::size_t other, std::size_t begin, std::size_t end, std::vector<FoundTie>& found) const {
    const PlacedMap& placed = placed_[other];
    if (!placed.map->hasGeometry()) return;
    SessionChoice all_sessions(*placed.map, false);
    PoseVerifier verifier(*placed.map, MetricConfig(), all_sessions);
    std::vector<Neighbour> neighbours;
    for (std::size_t camera = begin; camera < end; ++camera) {
      const auto anchor = anchorIn(other, camera, neighbours);
      if (!anchor) continue;
      const TrainingPose at = map_.pose(images_[camera]);
      const auto& model = map_.header().sessions[static_cast<std::size_t>(at.session)].camera;
      if (!model) continue;
      const auto features = map_.local(images_[camera]);
      verifier.startImage(at.stamp_ns, *features, *model);
      const auto pose = verifier.nearOneOf({*anchor});
      if (!pose) continue;
      const std::size_t matched = verifier.matched().training_image;
      const auto geometry = placed.map->geometry(matched);
      const CameraPose in_frame = placed.corrections[matched].of(pose->camera, geometry->camera.position_m);
      if ((in_frame.position_m - cameras_[camera].position_m).head<2>().norm() > kReach_m ||
          turnBetween(in_frame, cameras_[camera]) > kLargestTurn_rad) {
        continue;
      }
      found.push_back({{camera, in_frame, pose->covariance}, pose->map_covariance});
    }
  }

  /// The nearest image of a placed map that may show the same.
  std::optional<std::size_t> anchorIn(std::size_t other, std::size_t camera, std::vector<Neighbour>& neighbours) const {
    const Eigen::Vector2d position_m = cameras_[camera].position_m.head<2>();
    const PoseCorrection back = back_[other].at(position_m);
    const TrainingMap& map = *placed_[other].map;
    const double yaw_rad = map_.yaw_rad(images_[camera]);
    map.nearest(position_m + back.shift_m.head<2>(), kNeighbours, neighbours);
    for (const Neighbour& neighbour : neighbours) {
      if (neighbour.distance_m > kReach_m) break;
      if (faceAlike(map.yaw_rad(neighbour.image), yaw_rad)) return neighbour.image;
    }
    return std::nullopt;
  }

  /// One after the other, and of sessions that were tied when the map was made.
  std::vector<std::pair<std::size_t, std::size_t>> neighbours() const {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    std::vector<Neighbour> near;
    for (std::size_t camera = 0; camera < images_.size(); ++camera) {
      const std::size_t image = images_[camera];
      const int session = map_.pose(image).session;
      if (camera > 0 && map_.pose(images_[camera - 1]).session == session) pairs.emplace_back(camera - 1, camera);
      map_.nearestFacing(image, kNeighbours, kTiedSession_m, near);
      for (const Neighbour& neighbour : near) {
        if (neighbour.image >= image || camera_of_[neighbour.image] == kNone) continue;
        if (map_.pose(neighbour.image).session == session) continue;
        pairs.emplace_back(camera_of_[neighbour.image], camera);
        break;
      }
    }
    return pairs;
  }

  /// Unless hardly any tie agrees with them.
  void accept(const std::vector<PoseCorrection>& corrections) {
    std::vector<double> apart_m;
    std::vector<double> left_m;
    std::vector<std::optional<MapAlignment::Covariance>> covariances(map_.size());
    for (const FoundTie& found : ties_) {
      const std::size_t camera = found.tie.camera;
      const Eigen::Vector3d asked_m = found.tie.pose.position_m - cameras_[camera].position_m;
      const double left = (asked_m - corrections[camera].shift_m).head<2>().norm();
      if (left > kAgreeing_m) continue;
      apart_m.push_back(asked_m.head<2>().norm());
      left_m.push_back(left);
      covariances[images_[camera]] = found.map_covariance + found.tie.covariance;
    }
    const auto tied =
        std::count_if(covariances.begin(), covariances.end(), [](const auto& of) { return of.has_value(); });
    if (static_cast<std::size_t>(tied) < kLeastTied) return;
    alignment_.tied = static_cast<std::size_t>(tied);
    alignment_.apart_m = median(std::move(apart_m));
    alignment_.left_m = median(std::move(left_m));
    alignment_.covariances = std::move(covariances);
    moveAll(corrections);
  }

  /// Images without geometry move like the one nearest to them in their session that has it.
  void moveAll(const std::vector<PoseCorrection>& corrections) {
    for (std::size_t i = 0; i < map_.size(); ++i) {
      if (const auto camera = cameraFor(i)) {
        alignment_.corrections[i] = alignment_.corrections[i].then(corrections[*camera]);
      }
    }
  }

  std::optional<std::size_t> cameraFor(std::size_t image) const {
    if (camera_of_[image] != kNone) return camera_of_[image];
    const auto after = std::lower_bound(images_.begin(), images_.end(), image);
    const auto apart = [&](std::vector<std::size_t>::const_iterator other) {
      if (other == images_.end() || map_.pose(*other).session != map_.pose(image).session) return kNone;
      return *other > image ? *other - image : image - *other;
    };
    const auto before = after == images_.begin() ? images_.end() : std::prev(after);
    const auto nearest = apart(before) <= apart(after) ? before : after;
    if (apart(nearest) == kNone) return std::nullopt;
    return static_cast<std::size_t>(nearest - images_.begin());
  }

  const TrainingMap& map_;
  const std::vector<PlacedMap>& placed_;
  std::vector<FrameChange> back_;       ///< to the frame of each placed map
  std::vector<std::size_t> images_;     ///< those with geometry
  std::vector<CameraPose> cameras_;     ///< theirs, in the new frame
  std::vector<std::size_t> camera_of_;  ///< of each image; kNone: it has no geometry
  std::vector<FoundTie> ties_;
  MapAlignment alignment_;
};

}  // namespace

FrameChange::FrameChange(const LocalFrame& from, const LocalFrame& to)
    : from_(from), to_(to), same_(isSame(from.datum(), to.datum())) {}

PoseCorrection FrameChange::at(const Eigen::Vector2d& position_m) const {
  if (same_) return {};
  constexpr double kNorth_m = 100.0;  // far enough to tell a direction exactly
  const Eigen::Vector2d here_m = to_.toEastNorth(from_.toGeodetic(position_m));
  const Eigen::Vector2d there_m = to_.toEastNorth(from_.toGeodetic(position_m + kNorth_m * Eigen::Vector2d::UnitY()));
  const Eigen::Vector2d north = there_m - here_m;
  PoseCorrection change;
  change.turn = Eigen::AngleAxisd(std::atan2(-north.x(), north.y()), Eigen::Vector3d::UnitZ());
  change.shift_m.head<2>() = here_m - position_m;
  change.shift_m.z() = from_.datum().altitude_m - to_.datum().altitude_m;
  return change;
}

MapAlignment align(const TrainingMap& map, const LocalFrame& frame, const std::vector<PlacedMap>& placed,
                   std::size_t threads, const Progress& progress) {
  return Aligner(map, frame, placed).run(threads, progress);
}

}  // namespace visual_localization
