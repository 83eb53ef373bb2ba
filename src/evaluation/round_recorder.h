#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/experiment.h"
#include "evaluation/score_table.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {

/// Throws BagError when there is no believable fix.
Trajectory trueTrajectory(const BagReader& bag, const std::string& topic, const LocalFrame& frame);

/// Relative to the folder of the bag.
std::string besideBag(const std::string& bag, const std::string& file);

/// As map_builder does. Throws BagError when the bag does not give a map, or when landmarks are wanted and its camera
/// is not calibrated, and CameraError.
std::shared_ptr<const TrainingMap> recordMap(const std::string& bag, const RoundSpec& recording,
                                             const MapBuilderConfig& config);

/// Extracts and prunes features as the localizer does, and measures what that costs. Images that cannot be used are
/// left out. `for_poses`: keeps all features and the camera. Throws BagError when no image is left or none has a true
/// position, CameraError, and FileError for poses that cannot be used.
std::shared_ptr<const Drive> recordDrive(const std::string& bag, const RoundSpec& recording,
                                         const MapBuilderConfig& map, const LocalizerConfig& front_end,
                                         bool for_poses = false);

/// Empty when the recording has neither poses nor another topic of true positions than its fixes.
std::vector<std::optional<TruePose>> trueMapPoses(const std::string& bag, const RoundSpec& recording,
                                                  const MapBuilderConfig& config, const TrainingMap& map);

}  // namespace visual_localization
