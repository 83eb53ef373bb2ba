#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "visual_localization/base/progress.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// What is no record of use. The text is one line.
class UsageFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// How often drives matched images and landmarks of a map. Kept beside the map, never in it.
class MapUsage {
 public:
  struct OfImage {
    std::uint64_t poses = 0;                           ///< that rest on it more than on any other image
    std::map<std::uint32_t, std::uint64_t> landmarks;  ///< how many of them agreed, by the SIFT feature that shows it
  };

  void add(const TrainingMap& map, const MatchedLandmarks& matched);
  void add(const MapUsage& other);

  /// Null when no pose rests on the image of this time.
  const OfImage* find(std::int64_t stamp_ns) const;
  bool empty() const { return images_.empty(); }

  /// A line "stamp_ns,poses,landmarks" for each image that was used; landmarks as "feature:count feature:count".
  std::string toCsv() const;
  /// Throws UsageFileError, naming the line.
  static MapUsage fromCsv(const std::string& text);

 private:
  std::map<std::int64_t, OfImage> images_;  ///< by their stamps, which no edit of a map changes
};

/// What a summary keeps of each place: images within kPlace_m of each other that look the same way.
struct SummaryConfig {
  std::size_t images_per_place = 4;      ///< those that were used most; but one of each session at least
  std::size_t landmarks_per_image = 40;  ///< at least, used or not
  bool unused_places = true;             ///< false: a place of which no image was used keeps all
};
constexpr double kPlace_m = 5.0;

/// Which images stay. One that was never used goes first, then the one that was used least. Every session keeps its
/// most used image of each place: a rare light would starve otherwise.
std::vector<bool> summary(const TrainingMap& map, const MapUsage& usage, const SummaryConfig& config);

/// Of an image that was used.
void dropUnusedLandmarks(TrainingImage& image, const MapUsage& usage, const SummaryConfig& config);

/// An edit that makes no sense. The text is one line.
class MapEditError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Images of `map`, opened with strictLoading(), that `keep` has; sessions without images go. `edit`: for
/// MapHeader::history; empty: nothing. `change`: what else becomes of an image. Throws MapStoreError, and MapEditError
/// when no image is left.
void writeSelection(const TrainingMap& map, const std::vector<bool>& keep, const std::string& edit,
                    const std::string& path, const Progress& progress = {},
                    const std::function<void(TrainingImage&)>& change = {});

/// Throws MapEditError, with the names that there are.
std::vector<bool> withoutSession(const TrainingMap& map, const std::string& name);

/// From the one kept before, session by session.
std::vector<bool> spaced(const TrainingMap& map, double spacing_m);

}  // namespace visual_localization
