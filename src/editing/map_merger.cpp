#include "editing/map_merger.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "base/numbers.h"
#include "base/parallel.h"
#include "localization/pose_verifier.h"
#include "map/map_geometry.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"

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

namespace {

/// Their first stamp and the names of their sessions.
auto ageOf(const TrainingMap& map) {
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 0; i < map.size(); ++i) first_ns = std::min(first_ns, map.pose(i).stamp_ns);
  std::vector<std::string> names;
  for (const Session& session : map.header().sessions) names.push_back(session.name);
  return std::pair(first_ns, std::move(names));
}

void requireAlike(const NamedMap& first, const NamedMap& other) {
  const MapHeader& a = first.map->header();
  const MapHeader& b = other.map->header();
  const auto text = [](cv::Size size) { return std::to_string(size.width) + "x" + std::to_string(size.height); };
  if (a.image_size != b.image_size) {
    throw MergeError(other.name + ": its images are of " + text(b.image_size) + " pixels, those of " + first.name +
                     " of " + text(a.image_size));
  }
  if (a.kind->name() != b.kind->name()) {
    throw MergeError(other.name + ": its local features are '" + b.kind->name() + "', those of " + first.name + " '" +
                     a.kind->name() + "'");
  }
  const ParameterValues ours = a.kind->parameters();
  for (const auto& [name, value] : b.kind->parameters()) {
    if (value == ours.at(name)) continue;
    throw MergeError(other.name + ": its features were extracted with '" + name + "' = " + parameters::toString(value) +
                     ", those of " + first.name + " with " + parameters::toString(ours.at(name)));
  }
  const double distance_m = distanceBetween_m(a.datum, b.datum);
  if (distance_m <= kFarthestSession_m) return;
  throw MergeError(other.name + ": is " + std::to_string(std::llround(1e-3 * distance_m)) + " km away from " +
                   first.name + ", and one map reaches " + std::to_string(std::llround(1e-3 * kFarthestSession_m)) +
                   " km");
}

/// Which recordings are in the new map already, by the stamps of their images.
class KnownSessions {
 public:
  /// Throws MergeError when most images of a session are there.
  void add(const NamedMap& of) {
    const TrainingMap& map = *of.map;
    const auto session = knownSession(map, [this](std::int64_t stamp_ns) { return owners_.count(stamp_ns) != 0; });
    if (session) {
      throw MergeError(of.name + ": its session '" + map.header().sessions[*session].name + "' is in " +
                       maps_[ownerOf(map, *session)] + " already (the same times): remove it from one of them");
    }
    for (std::size_t i = 0; i < map.size(); ++i) owners_.emplace(map.pose(i).stamp_ns, maps_.size());
    maps_.push_back(of.name);
  }

 private:
  /// Of the first image that is known; the session has one.
  std::size_t ownerOf(const TrainingMap& map, std::size_t session) const {
    for (std::size_t i = 0;; ++i) {
      const auto owner = owners_.find(map.pose(i).stamp_ns);
      if (static_cast<std::size_t>(map.pose(i).session) == session && owner != owners_.end()) return owner->second;
    }
  }

  std::vector<std::string> maps_;
  std::unordered_map<std::int64_t, std::size_t> owners_;  ///< which map has an image of this time
};

/// Puts images of several maps into one file.
class Merger {
 public:
  /// `target`: the path of a map, or a file that stays the caller's.
  template <class Target>
  Merger(const Target& target, MapHeader header) : writer_(target, header.kind), header_(std::move(header)) {
    header_.sessions.clear();
    header_.history.clear();
  }

  void append(const TrainingMap& map, const MapAlignment& alignment) {
    const auto first_session = static_cast<int>(header_.sessions.size());
    for (const Session& session : map.header().sessions) {
      header_.sessions.push_back(session);
      header_.sessions.back().name = unusedName(session.name, names_);
      names_.insert(header_.sessions.back().name);
    }
    header_.history.insert(header_.history.end(), map.header().history.begin(), map.header().history.end());
    const std::uint64_t first_id = next_id_;
    for (std::size_t i = 0; i < map.size(); ++i) {
      TrainingImage image = map.image(i);
      move(image, alignment.corrections[i], map.header().sessions[static_cast<std::size_t>(image.session)]);
      image.session += first_session;
      if (image.geometry) {
        if (alignment.covariances[i]) image.geometry->covariance = *alignment.covariances[i];
        number(*image.geometry, first_id);
      }
      image.vlad = header_.vocabulary ? header_.vocabulary->describe(image.local) : VladDescriptor();
      writer_.append(image);
    }
  }

  void finish(const std::string& edit) {
    header_.history.push_back(edit);
    writer_.finish(header_);
  }

 private:
  static void move(TrainingImage& image, const PoseCorrection& correction, const Session& session) {
    if (correction.isNone()) return;
    if (!image.geometry) {
      image.position_m += correction.shift_m.head<2>();
      image.yaw_rad = correction.of(CameraPose{levelCamera(image.yaw_rad), Eigen::Vector3d::Zero()}).yaw_rad();
      return;
    }
    ImageGeometry geometry = std::move(*image.geometry);
    geometry.camera = correction.of(geometry.camera);
    const Eigen::Matrix3d turn = correction.turn.toRotationMatrix();
    Eigen::Matrix<double, 6, 6> both = Eigen::Matrix<double, 6, 6>::Zero();
    both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = turn;
    const Eigen::Matrix<double, 6, 6> turned = both * geometry.covariance * both.transpose();
    geometry.covariance = 0.5 * (turned + turned.transpose());  // rounding
    for (SeenLandmark& landmark : geometry.landmarks) landmark.offset_m = turn.cast<float>() * landmark.offset_m;
    placeByCamera(image, session.mount.value_or(SensorMount()), std::move(geometry));
  }

  /// Landmarks of two maps are different ones.
  void number(ImageGeometry& geometry, std::uint64_t first_id) {
    for (SeenLandmark& landmark : geometry.landmarks) {
      const std::uint64_t id = first_id + landmark.id;
      if (id > std::numeric_limits<std::uint32_t>::max()) throw MergeError("a map has at most 4294967296 landmarks");
      landmark.id = static_cast<std::uint32_t>(id);
      next_id_ = std::max(next_id_, id + 1);
    }
  }

  MapWriter writer_;
  MapHeader header_;
  std::set<std::string> names_;
  std::uint64_t next_id_ = 0;
};

/// Of the images of all maps.
std::shared_ptr<const VladVocabulary> commonVocabulary(const std::vector<NamedMap>& maps) {
  std::vector<std::size_t> ends;
  for (const NamedMap& of : maps) ends.push_back((ends.empty() ? 0 : ends.back()) + of.map->size());
  const auto features = [&](std::size_t i) {
    const auto map = std::upper_bound(ends.begin(), ends.end(), i) - ends.begin();
    const TrainingMap& of = *maps[static_cast<std::size_t>(map)].map;
    return of.local(i + of.size() - ends[static_cast<std::size_t>(map)]);
  };
  return VladVocabulary::learn(ends.back(), features, maps.front().map->header().image_size);
}

template <class Target>
std::vector<MergedMap> mergeTo(const Target& target, const std::vector<NamedMap>& maps, const std::string& edit,
                               std::size_t threads, const Progress& progress) {
  KnownSessions known;
  for (const NamedMap& map : maps) {
    requireAlike(maps.front(), map);
    known.add(map);
  }
  const LocalFrame frame = maps.front().map->frame();
  MapHeader header = maps.front().map->header();
  header.vocabulary = commonVocabulary(maps);
  Merger merger(target, std::move(header));
  std::vector<PlacedMap> placed;
  std::vector<MergedMap> merged;
  for (const NamedMap& of : maps) {
    const MapAlignment alignment = align(*of.map, frame, placed, threads, progress);
    merger.append(*of.map, alignment);
    merged.push_back(
        {of.name, of.map->size(), of.map->geometryCount(), alignment.tied, alignment.apart_m, alignment.left_m});
    placed.push_back({of.map, alignment.corrections});
  }
  merger.finish(edit);
  return merged;
}

}  // namespace

std::optional<std::size_t> knownSession(const TrainingMap& map, const std::function<bool(std::int64_t)>& known) {
  std::vector<std::size_t> images(map.header().sessions.size());
  std::vector<std::size_t> known_images(images.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto session = static_cast<std::size_t>(map.pose(i).session);
    ++images[session];
    if (known(map.pose(i).stamp_ns)) ++known_images[session];
  }
  for (std::size_t s = 0; s < images.size(); ++s) {
    if (2 * known_images[s] > images[s]) return s;
  }
  return std::nullopt;
}

std::vector<NamedMap> inOrderOfTime(std::vector<NamedMap> maps) {
  std::vector<std::pair<decltype(ageOf(*maps.front().map)), std::size_t>> ages;
  for (std::size_t k = 0; k < maps.size(); ++k) ages.emplace_back(ageOf(*maps[k].map), k);
  std::sort(ages.begin(), ages.end());
  std::vector<NamedMap> ordered;
  for (const auto& [age, k] : ages) ordered.push_back(std::move(maps[k]));
  return ordered;
}

std::vector<MergedMap> mergeMaps(const std::vector<NamedMap>& maps, const std::string& edit, const std::string& path,
                                 std::size_t threads, const Progress& progress) {
  return mergeTo(path, maps, edit, threads, progress);
}

std::vector<MergedMap> mergeMaps(const std::vector<NamedMap>& maps, const std::string& edit, const PartialFile& file,
                                 std::size_t threads, const Progress& progress) {
  return mergeTo(file, maps, edit, threads, progress);
}

}  // namespace visual_localization
