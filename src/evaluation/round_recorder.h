#pragma once

#include <memory>
#include <string>

#include "evaluation/experiment.h"
#include "evaluation/score_table.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/geo/local_frame.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {

/// The believable fixes of a topic as true positions over time. Throws BagError when there is none.
Trajectory trueTrajectory(const BagReader& bag, const std::string& topic, const LocalFrame& frame);

/// Makes a map of a recording as map_builder does. `bag`: path. Throws BagError when the bag does not give a map.
std::shared_ptr<const TrainingMap> recordMap(const std::string& bag, const RoundSpec& recording,
                                             const MapBuilderConfig& config);

/// Makes a drive of a recording: extracts and prunes its features image by image as the localizer does, and measures
/// what that costs. Images that cannot be used are left out. Throws BagError when there is none left or none has a true
/// position.
std::shared_ptr<const Drive> recordDrive(const std::string& bag, const RoundSpec& recording,
                                         const MapBuilderConfig& map, const LocalizerConfig& front_end);

}  // namespace visual_localization
