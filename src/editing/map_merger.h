#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/files.h"
#include "visual_localization/base/progress.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

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
