#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/files.h"
#include "geometry/pose_corrections.h"
#include "visual_localization/base/progress.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Both frames are flat, so that the change depends on the position.
class FrameChange {
 public:
  FrameChange(const LocalFrame& from, const LocalFrame& to);

  /// East and north in the first frame.
  PoseCorrection at(const Eigen::Vector2d& position_m) const;

 private:
  LocalFrame from_;
  LocalFrame to_;
  bool same_;
};

/// A map whose images lie in the frame of the new map already.
struct PlacedMap {
  std::shared_ptr<const TrainingMap> map;
  std::vector<PoseCorrection> corrections;  ///< of each image, from the map's own frame
};

/// How the images of a map come to lie beside those of the maps before it.
struct MapAlignment {
  using Covariance = Eigen::Matrix<double, 6, 6>;

  std::vector<PoseCorrection> corrections;             ///< of each image, from the map's own frame
  std::vector<std::optional<Covariance>> covariances;  ///< of each image's pose where another map decides it
  std::size_t tied = 0;                                ///< images that landmarks of the maps before agree on
  double apart_m = 0.0;  ///< horizontal distance from where these see it: median before the alignment
  double left_m = 0.0;   ///< and after it
};

/// Lays `map` beside the `placed` ones, which stay, in `frame`: images near one of theirs are located by their
/// landmarks, and between these the map's own geometry holds. Where fewer than kLeastTied images overlap it lies where
/// its own fixes have it. The result does not depend on the number of threads.
MapAlignment align(const TrainingMap& map, const LocalFrame& frame, const std::vector<PlacedMap>& placed,
                   std::size_t threads, const Progress& progress = {});

constexpr std::size_t kLeastTied = 5;

/// Maps that cannot become one. The text is one line and begins with the name of a map.
class MergeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A map and how it is called, opened with strictLoading().
struct NamedMap {
  std::string name;
  std::shared_ptr<const TrainingMap> map;
};

/// Of which most images have a stamp that is `known`: the same recording.
std::optional<std::size_t> knownSession(const TrainingMap& map, const std::function<bool(std::int64_t)>& known);

/// Where a map came to lie in the new one.
struct MergedMap {
  std::string name;
  std::size_t images = 0;
  std::size_t with_landmarks = 0;  ///< images
  std::size_t tied = 0;            ///< see MapAlignment; 0 for the first map, which stays
  double apart_m = 0.0;
  double left_m = 0.0;
};

/// The oldest recording first, whatever the order of the arguments.
std::vector<NamedMap> inOrderOfTime(std::vector<NamedMap> maps);

/// The first map stays as it is, and its frame is that of the new map; each other one is aligned with those before it
/// (see align). Sessions of one name get numbers. `edit`: for MapHeader::history. Throws MergeError when images or
/// features are of another kind, maps are too far apart, or a session is in both; MapStoreError.
std::vector<MergedMap> mergeMaps(const std::vector<NamedMap>& maps, const std::string& edit, const std::string& path,
                                 std::size_t threads, const Progress& progress = {});
/// Into a file that stays the caller's: nothing is put in place.
std::vector<MergedMap> mergeMaps(const std::vector<NamedMap>& maps, const std::string& edit, const PartialFile& file,
                                 std::size_t threads, const Progress& progress = {});

}  // namespace visual_localization
