#include "bag/recorded_mount.h"

#include "base/text.h"

namespace visual_localization {
namespace {

/// /tf has a hundred messages a second: it is read where /tf_static does not tell.
std::optional<RobotMount> mountBy(const BagReader& frames, const MountQuery& query, const std::string& image_frame) {
  try {
    if (const auto found = robotMount(*frames.transforms(false), query.base_frame, image_frame, query.antenna_frame)) {
      return found;
    }
  } catch (const MountError&) {
  }
  return robotMount(*frames.transforms(true), query.base_frame, image_frame, query.antenna_frame);
}

}  // namespace

std::optional<RobotMount> recordedMount(const BagReader& bag, const MountQuery& query,
                                        const std::vector<std::string>& others) {
  const std::string image_frame = bag.imageFrame(query.image_topic);
  try {
    if (const auto found = mountBy(bag, query, image_frame)) return found;
    for (const std::string& path : others) {
      if (path == bag.path()) continue;
      std::optional<RobotMount> found = mountBy(BagReader(path), query, image_frame);
      if (!found) continue;
      found->said += ", as " + oneLine(path) + " has them";
      return found;
    }
    return std::nullopt;
  } catch (const MountError& error) {
    throw BagError(bag.path() + ": " + oneLine(error.what(), 1000));
  }
}

}  // namespace visual_localization
