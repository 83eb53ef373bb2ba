#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include "visual_localization/localizer/estimate.h"
#include "visual_localization/ros/node_config.h"
#include "visual_localization/ros/rate_meter.h"

namespace visual_localization {

/// How many images came to what end, since start.
struct ImageCounts {
  std::uint64_t processed = 0;
  std::uint64_t dropped = 0;  ///< replaced by a newer one before they were processed
  std::uint64_t late = 0;     ///< older than one that was processed
  std::uint64_t refused = 0;  ///< unusable
};

/// What the node tells on /diagnostics: state, images, latency, map. Thread-safe.
class LocalizerDiagnostics {
 public:
  /// Tells where images should come from.
  using DescribeCamera = std::function<std::string()>;

  /// `name` of the node. It is an error when no image comes for longer than the timeout.
  LocalizerDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::string& name,
                       const NodeConfig& config, DescribeCamera describe_camera);

  void setImageTimeout(double image_timeout_s);
  void imageArrived();
  void imageProcessed(const Estimate& estimate, double latency_ms, const ImageCounts& counts);
  void imageRefused(const ImageCounts& counts, const std::string& reason);
  /// How long no image has come, when that is longer than the timeout.
  std::optional<double> silence_s();
  /// The state has changed without an image.
  void stateIs(LocalizationState state);
  /// Empty when the transform was broadcast.
  void transformMissing(const std::string& reason);
  void mapLoaded(const std::string& path, std::size_t images);
  void publish() { updater_.force_update(); }

 private:
  using Clock = std::chrono::steady_clock;
  using Wrapper = diagnostic_updater::DiagnosticStatusWrapper;

  void reportState(Wrapper& status);
  void reportImages(Wrapper& status);
  void reportMap(Wrapper& status);
  void reportTransform(Wrapper& status);
  double age_s() const;

  std::mutex mutex_;
  double image_timeout_s_;
  std::optional<Estimate> estimate_;
  double latency_ms_ = 0.0;
  ImageCounts counts_;
  std::string last_refusal_;
  std::string map_path_;
  std::size_t map_images_ = 0;
  std::string missing_transform_;
  DescribeCamera describe_camera_;
  RateMeter arrivals_;
  const Clock::time_point start_ = Clock::now();
  std::optional<Clock::time_point> last_arrival_;
  diagnostic_updater::Updater updater_;  ///< last: it refers to everything above
};

}  // namespace visual_localization
