#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "visual_localization/localization/localizer.h"
#include "visual_localization/localization/odometry.h"

namespace visual_localization::apps {

/// Odometry of the drive, as the robot would get it: up to the stamp of an image before the image. What lies between
/// two images that do not follow each other was not driven.
class OdometryFeed {
 public:
  explicit OdometryFeed(std::vector<OdometryReading> readings) : readings_(std::move(readings)) {
    std::stable_sort(readings_.begin(), readings_.end(), isBefore);
  }

  void feed(std::int64_t stamp_ns, bool follows, Localizer& localizer) {
    if (!follows) next_ = first(stamp_ns - kBefore_ns);
    for (; next_ < readings_.size() && readings_[next_].stamp_ns <= stamp_ns; ++next_) {
      localizer.addOdometry(readings_[next_]);
    }
  }

 private:
  static constexpr std::int64_t kBefore_ns = 500'000'000;

  static bool isBefore(const OdometryReading& a, const OdometryReading& b) { return a.stamp_ns < b.stamp_ns; }

  std::size_t first(std::int64_t stamp_ns) const {
    const auto found =
        std::lower_bound(readings_.begin(), readings_.end(), OdometryReading{stamp_ns, {}, 0.0}, isBefore);
    return static_cast<std::size_t>(found - readings_.begin());
  }

  std::vector<OdometryReading> readings_;
  std::size_t next_ = 0;
};

}  // namespace visual_localization::apps
