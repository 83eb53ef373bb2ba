#pragma once

#include <cstddef>
#include <cstdint>
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
};

/// Which images of a recording are used, by their stamps.
struct ImageOrder {
  std::vector<bool> used;
  std::optional<Remark> remark;  ///< about the others
};

/// As many as have stamps that grow: one stamp far ahead costs one image. Where stamps go back once and stay there, a
/// clock was set: then only the longer of both parts, which has one clock.
ImageOrder orderOf(const std::vector<std::int64_t>& stamps_ns);
/// Throws BagError when it would use less than half of the images.
ImageOrder orderOf(const BagReader& bag, const BagImages& images);

/// Compares turns of the path with turns of the pictures, of which it reads at most four a second. Throws BagError,
/// with both ranges of time, when fixes and images have none in common.
ClockCheck checkClock(const BagReader& bag, const BagImages& images, const ImageOrder& order,
                      const std::vector<Fix>& fixes, const MapBuilderConfig& config,
                      const std::optional<SensorMount>& mount, std::size_t threads);

/// One line each, of the first few pauses longer than cleaning bridges and of stamps that go back.
std::vector<Remark> breaksOf(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config);

std::vector<Fix> putRight(std::vector<Fix> fixes, const ClockCheck& check);

}  // namespace visual_localization::apps
