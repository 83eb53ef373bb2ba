#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ros/static_transforms.h"
#include "visual_localization/bag/bag_reader.h"

namespace visual_localization {

/// Which frames of a recording are asked for.
struct MountQuery {
  std::string base_frame;
  std::string image_topic;
  std::optional<std::string> antenna_frame = {};  ///< none: the camera alone
};

/// By the frames in the bag, or in the first of `others` that has any: a split recording has /tf_static in its first
/// part alone. Nothing when none has frames. Throws BagError that names the frames when they do not tell.
std::optional<RobotMount> recordedMount(const BagReader& bag, const MountQuery& query,
                                        const std::vector<std::string>& others = {});

}  // namespace visual_localization
