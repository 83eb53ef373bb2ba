#pragma once

#include <cstdint>
#include <optional>

namespace visual_localization {

/// Tells images that come late from time that goes back: an image older than the newest one is late; when the next one
/// is older too, and not older than that one, time has gone back, as when a bag begins anew. One image of a new round
/// is lost by that, and two publishers whose clocks differ cannot drag the time to and fro.
class StampMonitor {
 public:
  enum class Verdict : std::uint8_t {
    kInOrder,   ///< not older than the newest
    kLate,      ///< older, of no use any more
    kWentBack,  ///< older, and the beginning of another time
  };

  /// `stamp_ns` of the image that came now.
  Verdict judge(std::int64_t stamp_ns);
  /// How much older than the newest image the last one was, seconds; zero when it was not.
  double lag_s() const { return lag_s_; }

 private:
  std::optional<std::int64_t> newest_ns_;
  std::optional<std::int64_t> late_ns_;  ///< of the image before, if that was late
  double lag_s_ = 0.0;
};

}  // namespace visual_localization
