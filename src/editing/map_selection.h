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

/// How often drives matched the images of a map and their landmarks. Kept beside the map, never in it.
class MapUsage {
 public:
  struct OfImage {
    std::uint64_t poses = 0;                           ///< that rest on it more than on any other image
    std::map<std::uint32_t, std::uint64_t> landmarks;  ///< how many of them agreed, by the SIFT feature that shows it
  };

  /// What a metric pose rests on.
  void add(const TrainingMap& map, const MatchedLandmarks& matched);
  /// What another drive used.
  void add(const MapUsage& other);

  /// Null when no pose rests on the image of this time.
  const OfImage* find(std::int64_t stamp_ns) const;
  bool empty() const { return images_.empty(); }

  /// "stamp_ns,poses,landmarks" and a line for each image that was used; landmarks as "feature:count feature:count".
  std::string toCsv() const;
  /// Inverse of toCsv(). Throws UsageFileError, naming the line.
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

/// Which images of `map` stay. An image that was never used goes first, then the one that was used least. Every session
/// keeps its most used image of each place where it has one: a rare light would starve otherwise.
std::vector<bool> summary(const TrainingMap& map, const MapUsage& usage, const SummaryConfig& config);

/// Leaves out landmarks that were never used, of an image that was.
void dropUnusedLandmarks(TrainingImage& image, const MapUsage& usage, const SummaryConfig& config);

/// An edit that makes no sense. The text is one line.
class MapEditError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Those images of `map`, opened with strictLoading(), that `keep` has, as a map file; sessions without images go.
/// `edit`: for MapHeader::history; empty: nothing. `change`: what else becomes of an image. Throws MapStoreError, and
/// MapEditError when no image is left.
void writeSelection(const TrainingMap& map, const std::vector<bool>& keep, const std::string& edit,
                    const std::string& path, const Progress& progress = {},
                    const std::function<void(TrainingImage&)>& change = {});

/// All images but those of the session of this name. Throws MapEditError, with the names that there are.
std::vector<bool> withoutSession(const TrainingMap& map, const std::string& name);

/// Images that are at least this far from the one kept before, session by session.
std::vector<bool> spaced(const TrainingMap& map, double spacing_m);

}  // namespace visual_localization
