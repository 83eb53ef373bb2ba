#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "geometry/session_geometry.h"
#include "map/position_index.h"
#include "visual_localization/geo/local_frame.h"
#include "visual_localization/geo/trajectory_cleaner.h"
#include "visual_localization/map/training_map.h"

/// Sessions of a map: their names, where they lie, their images by position. What is refused is a std::runtime_error in
/// one line.
namespace visual_localization {

/// A name for one more session of a map: `name`, or with a number behind it if it is in use.
inline std::string unusedName(const std::string& name, const std::set<std::string>& used) {
  std::string unused = name;
  for (std::size_t n = 2; used.count(unused) != 0; ++n) unused = name + "_" + std::to_string(n);
  return unused;
}

/// A frame around the first believable fix.
LocalFrame frameFor(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config);
/// On the earth, since a tangent plane shows its far side near the datum again.
double distanceBetween_m(const GeodeticPoint& a, const GeodeticPoint& b);
/// Refuses fixes whose middle is farther than kFarthestSession_m from the datum.
void requireNear(const std::vector<Fix>& fixes, const GeodeticPoint& datum);
/// Refuses a path that spans less than kSmallestSession_m: all images of the drive would be on one spot.
void requireMotion(const CleanedTrajectory& cleaned);
/// Those that have a position, in order of time.
std::vector<MapFix> inFrame(const std::vector<Fix>& fixes, const LocalFrame& frame);

/// The training images of each session of a map by their positions.
class SessionIndex {
 public:
  explicit SessionIndex(const TrainingMap& map);

  /// False for a session of which the map has no image.
  bool has(std::size_t session) const { return sessions_[session].index != nullptr; }
  /// The image of a session that is nearest to `position_m`; the session has one.
  Neighbour nearest(std::size_t session, const Eigen::Vector2d& position_m) const;
  /// Into `found`: images of a session that `accept` takes, as PositionIndex::nearest finds them.
  void nearest(std::size_t session, const Eigen::Vector2d& position_m, const PositionIndex::Search& search,
               const std::function<bool(std::size_t image)>& accept, std::vector<Neighbour>& found) const;

 private:
  struct Session {
    std::vector<std::size_t> images;
    std::unique_ptr<const PositionIndex> index;  ///< of their positions
  };

  std::vector<Session> sessions_;
};

}  // namespace visual_localization
