#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/map_export.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/map/map_builder.h"

namespace visual_localization::apps {

/// What the stamps of a recording's fixes say against those of its images.
struct ClockCheck {
  double offset_s = 0.0;   ///< to be taken off the fixes' stamps
  double sigma_s = 0.0;    ///< of what is left then; 0: not checked
  bool exchanged = false;  ///< the fixes' latitude and longitude are to be exchanged
  Remark remark;
  std::optional<Remark> went_back = {};  ///< the stamps of images did
};

/// Compares turns of the path with turns of the pictures, of which it reads at most four a second. Throws BagError,
/// with both ranges of time, when fixes and images have none in common.
ClockCheck checkClock(const BagReader& bag, const BagImages& images, const std::vector<Fix>& fixes,
                      const MapBuilderConfig& config, const std::optional<SensorMount>& mount, std::size_t threads);

/// One line each, of the first few pauses longer than cleaning bridges and of stamps that go back.
std::vector<Remark> breaksOf(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config);

std::vector<Fix> putRight(std::vector<Fix> fixes, const ClockCheck& check);

}  // namespace visual_localization::apps
