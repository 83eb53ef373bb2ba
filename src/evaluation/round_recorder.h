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

/// The believable fixes of a topic as true positions over time. Throws BagError when there is none.
Trajectory trueTrajectory(const BagReader& bag, const std::string& topic, const LocalFrame& frame);

/// A file that an experiment names for a recording: relative to the folder of its bag.
std::string besideBag(const std::string& bag, const std::string& file);

/// Makes a map of a recording as map_builder does. `bag`: path. Throws BagError when the bag does not give a map, or
/// when landmarks are wanted and its camera is not calibrated, and CameraError for a calibration that cannot be used.
std::shared_ptr<const TrainingMap> recordMap(const std::string& bag, const RoundSpec& recording,
                                             const MapBuilderConfig& config);

/// Makes a drive of a recording: extracts and prunes its features image by image as the localizer does, and measures
/// what that costs. Images that cannot be used are left out. `for_poses`: keeps all features and the camera, so that
/// poses can be solved. Throws BagError when there is none left or none has a true position, CameraError for a
/// calibration and FileError for poses that cannot be used.
std::shared_ptr<const Drive> recordDrive(const std::string& bag, const RoundSpec& recording,
                                         const MapBuilderConfig& map, const LocalizerConfig& front_end,
                                         bool for_poses = false);

/// Where the images of a map truly were taken. Empty when the recording has neither poses nor another topic of true
/// positions than its fixes.
std::vector<std::optional<TruePose>> trueMapPoses(const std::string& bag, const RoundSpec& recording,
                                                  const MapBuilderConfig& config, const TrainingMap& map);

}  // namespace visual_localization
