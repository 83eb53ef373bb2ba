#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include "node/image_worker.h"
#include "node/node_config.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// What is wrong with the image, in one line for people; empty for one that is recognised or seems well.
std::string imageTrouble(const Estimate& estimate);

/// Rate of events over the last seconds, so that events rarer than the reports show their rate, not 1 and 0 in turn.
class RateMeter {
 public:
  using Clock = std::chrono::steady_clock;

  explicit RateMeter(std::chrono::milliseconds window = std::chrono::seconds(10)) : window_(window) {}

  void add(Clock::time_point now = Clock::now()) {
    times_.push_back(now);
    forget(now);
  }

  /// Zero with fewer than two events in the window.
  double rate_hz(Clock::time_point now = Clock::now()) {
    forget(now);
    if (times_.size() < 2) return 0.0;
    const double span_s = std::chrono::duration<double>(times_.back() - times_.front()).count();
    return span_s > 0.0 ? static_cast<double>(times_.size() - 1) / span_s : 0.0;
  }

 private:
  void forget(Clock::time_point now) {
    while (!times_.empty() && now - times_.front() > window_) times_.pop_front();
  }

  std::chrono::milliseconds window_;
  std::deque<Clock::time_point> times_;
};

/// What the node reports on /diagnostics: state, images, latency, map. Thread-safe.
class LocalizerDiagnostics {
 public:
  using DescribeCamera = std::function<std::string()>;
  using CountImages = std::function<ImageCounts()>;

  /// It is an error when no image comes for longer than the timeout.
  LocalizerDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::string& name,
                       const NodeConfig& config, DescribeCamera describe_camera, CountImages count_images);

  void setImageTimeout(double image_timeout_s);
  void imageArrived();
  void imageProcessed(const Estimate& estimate, double latency_ms);
  void imageRefused(const std::string& reason);
  /// Nothing while shorter than the timeout.
  std::optional<double> silence_s();
  /// Without an image.
  void stateIs(LocalizationState state, const Why& why);
  /// Empty when the transform was broadcast.
  void transformMissing(const std::string& reason);
  void mapLoaded(const std::string& path, std::size_t images);
  /// `trouble`: why the last calibration is not used; empty when it is.
  void cameraIs(const std::string& description, const std::string& trouble);
  void publish() { updater_.force_update(); }

 private:
  using Clock = std::chrono::steady_clock;
  using Wrapper = diagnostic_updater::DiagnosticStatusWrapper;

  void reportState(Wrapper& status);
  void reportImages(Wrapper& status);
  void reportMap(Wrapper& status);
  void reportCamera(Wrapper& status);
  void reportTransform(Wrapper& status);
  double age_s() const;

  std::mutex mutex_;
  double image_timeout_s_;
  std::optional<Estimate> estimate_;
  double latency_ms_ = 0.0;
  std::string last_refusal_;
  std::string map_path_;
  std::size_t map_images_ = 0;
  std::string missing_transform_;
  std::string camera_;
  std::string camera_trouble_;
  DescribeCamera describe_camera_;
  CountImages count_images_;
  RateMeter arrivals_;
  const Clock::time_point start_ = Clock::now();
  std::optional<Clock::time_point> last_arrival_;
  diagnostic_updater::Updater updater_;  ///< last: it refers to everything above
};

}  // namespace visual_localization
