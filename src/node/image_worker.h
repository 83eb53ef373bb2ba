#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <image_transport/image_transport.h>
#include <opencv2/core.hpp>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <std_msgs/Header.h>

#include "node/published_topics.h"
#include "node/shared_localizer.h"
#include "node/throttled_log.h"

namespace visual_localization {

/// An image as it arrived, not decoded yet: only the newest one is worth that.
struct ReceivedImage {
  std_msgs::Header header;
  std::function<cv::Mat()> decode;  ///< 8-bit grey; throws ImageError when the message is unusable
};

/// The subscription to the camera, by any transport.
class ImageSource {
 public:
  using Callback = std::function<void(ReceivedImage)>;

  /// `transport` compressed means `<image>/compressed`, decoded here without a plugin. Throws ParameterError when there
  /// is no such transport.
  ImageSource(ros::NodeHandle node, const ros::NodeHandle& private_node, const std::string& transport,
              Callback callback);

  /// Returns after a callback that is running.
  void shutdown();
  const std::string& topic() const { return topic_; }
  /// For people: the topic, how many publish it, and what else might be meant when nobody does.
  std::string description();

 private:
  image_transport::ImageTransport image_transport_;
  image_transport::Subscriber by_plugin_;
  ros::Subscriber compressed_;
  std::string topic_;  ///< kept, because a subscriber that is shut down has none
  PublishedTopics published_;
};

/// A queue of one between threads: a newer item replaces one that nobody has taken yet, so that a slow
/// consumer always works on the newest.
template <class Item>
class LatestQueue {
 public:
  /// Never blocks.
  void push(Item item) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return;
      if (item_) ++dropped_;
      item_ = std::move(item);
    }
    available_.notify_one();
  }

  /// Waits; nothing once the queue is closed.
  std::optional<Item> pop() {
    std::unique_lock<std::mutex> lock(mutex_);
    available_.wait(lock, [this] { return closed_ || item_; });
    if (closed_) return std::nullopt;
    return std::exchange(item_, std::nullopt);
  }

  /// Ends every wait, now and later.
  void close() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
      item_.reset();
    }
    available_.notify_all();
  }

  /// Replaced before anybody took them.
  std::uint64_t dropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable available_;
  std::optional<Item> item_;
  std::uint64_t dropped_ = 0;
  bool closed_ = false;
};

/// Tells images that come late from time that goes back: an image older than the newest one is late; when the next one
/// is older too, and not older than that one, time has gone back, as when a bag starts again. That costs one image of
/// the new time, and two publishers whose clocks differ cannot move the time back and forth.
class StampMonitor {
 public:
  enum class Verdict : std::uint8_t {
    kInOrder,   ///< not older than the newest
    kLate,      ///< older, no longer of use
    kWentBack,  ///< older, and the start of another time
  };

  /// `stamp_ns` of the image that came now.
  Verdict judge(std::int64_t stamp_ns);
  /// Seconds behind the newest image; zero when it was not.
  double lag_s() const { return lag_s_; }

 private:
  std::optional<std::int64_t> newest_ns_;
  std::optional<std::int64_t> late_ns_;  ///< of the image before, if that was late
  double lag_s_ = 0.0;
};

/// How many images came since the start, and what became of them. Each one ends in exactly one of the counts below
/// `received`; until then it waits or is being processed.
struct ImageCounts {
  std::uint64_t received = 0;
  std::uint64_t processed = 0;
  std::uint64_t dropped = 0;
  std::uint64_t late = 0;  ///< older than one that was processed
  std::uint64_t refused = 0;
  std::uint64_t without_map = 0;  ///< came while no map was loaded

  std::uint64_t ended() const { return processed + dropped + late + refused + without_map; }
};

/// One image and what the localizer says about it.
struct LocalizedImage {
  SharedLocalizer::Result result;  ///< finite
  std_msgs::Header header;         ///< of the image; a missing stamp is replaced by the time of processing
  bool has_stamp = true;
  cv::Mat grey;
};

/// Where the worker's thread hands its results.
class ImageOutput {
 public:
  virtual ~ImageOutput() = default;
  virtual void publish(const LocalizedImage& image, const ImageCounts& counts) = 0;
  virtual void refused(const std::string& /*reason*/) {}
  virtual void timeWentBack() {}
};

/// Localises the newest image in a thread of its own; the callbacks of roscpp only push.
class ImageWorker {
 public:
  /// All must outlive it. The outputs are served in their order.
  ImageWorker(SharedLocalizer& localizer, std::vector<ImageOutput*> outputs, ThrottledLog& log)
      : localizer_(localizer), outputs_(std::move(outputs)), log_(log) {}
  ~ImageWorker() { stop(); }
  ImageWorker(const ImageWorker&) = delete;
  ImageWorker& operator=(const ImageWorker&) = delete;

  /// `topic` names the camera in the log.
  void start(const std::string& topic);
  /// Finishes the image that is being processed.
  void stop();
  /// Never waits for the worker.
  void push(ReceivedImage image);
  ImageCounts counts() const;

 private:
  void work();
  /// Nothing for an image that ends otherwise.
  std::optional<LocalizedImage> localize(const ReceivedImage& image);
  void publish(const LocalizedImage& image);
  bool isLate(const ros::Time& stamp);
  void refuse(const std::string& reason);
  void count(std::uint64_t ImageCounts::*images);

  SharedLocalizer& localizer_;
  const std::vector<ImageOutput*> outputs_;
  ThrottledLog& log_;
  std::string topic_;
  LatestQueue<ReceivedImage> queue_;
  StampMonitor stamps_;  ///< of the worker's thread
  mutable std::mutex mutex_;
  ImageCounts counts_;  ///< but for the dropped ones, which the queue counts
  std::thread thread_;
};

}  // namespace visual_localization
