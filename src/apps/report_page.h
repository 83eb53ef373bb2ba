#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/map_export.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::apps {

/// Pictures of a page, by the number of their image.
class PagePictures {
 public:
  /// Of the files; base64 takes a third more.
  explicit PagePictures(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Not of every image once they take too many bytes: then every second one, every fourth, ... is kept.
  bool wants(std::size_t image) const { return image % stride_ == 0 && jpegs_.count(image) == 0; }
  /// Ignores one that is not wanted, and one without bytes.
  void add(std::size_t image, std::vector<std::uint8_t> jpeg);
  /// {"stride": 1, "jpeg": {"0": base64, ...}}
  nlohmann::json toJson() const;

 private:
  std::size_t most_bytes_;
  std::size_t bytes_ = 0;
  std::size_t stride_ = 1;
  std::map<std::size_t, std::vector<std::uint8_t>> jpegs_;
};

/// Rounded to so many decimal digits, which a page does not show anyway; null unless it is finite.
nlohmann::json pageNumber(double value, int decimals);

/// Training images (at most 20000, every "stride"-th), sessions and landmarks (at most 20000), without pictures. `path`
/// is the map's file.
nlohmann::json pageMap(const std::string& path, const TrainingMap& map);

/// What the page of a map alone has beside pageMap(): previews, the report and the stretches worth a look.
void addFindings(const std::string& path, const TrainingMap& map, const MapFindings& findings,
                 nlohmann::json& page_map);

/// What became of the fixes of each session.
void addBuild(const std::vector<PlottedSession>& sessions, const LocalFrame& frame, nlohmann::json& page_map);

/// A whole HTML page that needs no other file, of config/report. `data`: {"map": ..., "drive": ...}, the drive may be
/// missing. Texts in it may come from anyone.
std::string reportPage(nlohmann::json data);

}  // namespace visual_localization::apps
