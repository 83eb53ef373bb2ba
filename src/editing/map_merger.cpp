#include "editing/map_merger.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "editing/map_alignment.h"
#include "map/map_geometry.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
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
