#include "node/image_worker.h"

#include <exception>
#include <set>
#include <sstream>
#include <utility>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include "base/text.h"
#include "base/time.h"
#include "node/localizer_diagnostics.h"
#include "node/message_conversions.h"
#include "node/stamps.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

const char* const kCompressed = "compressed";
constexpr unsigned kImageQueue = 5;  ///< roscpp drops uncounted what does not fit; the worker's own queue of one counts

/// "image_transport/raw" is known to users as "raw".
std::set<std::string> knownTransports(const image_transport::ImageTransport& image_transport) {
  std::set<std::string> names{kCompressed};
  for (const std::string& name : image_transport.getLoadableTransports()) names.insert(name.substr(name.find('/') + 1));
  return names;
}

void requireTransport(const std::string& transport, const std::set<std::string>& known) {
  if (known.count(transport) != 0) return;
  throw ParameterError("parameter 'image_transport' = '" + transport + "' is not allowed: installed are " +
                       joined(known));
}

template <class MessagePtr>
ReceivedImage received(const MessagePtr& message) {
  return {message->header, [message] { return toGrey(*message); }};
}

}  // namespace

ImageSource::ImageSource(ros::NodeHandle node, const ros::NodeHandle& private_node, const std::string& transport,
                         Callback callback)
    : image_transport_(node) {
  requireTransport(transport, knownTransports(image_transport_));
  if (transport == kCompressed) {
    const boost::function<void(const sensor_msgs::CompressedImageConstPtr&)> forward =
        [callback](const sensor_msgs::CompressedImageConstPtr& message) { callback(received(message)); };
    compressed_ =
        node.subscribe<sensor_msgs::CompressedImage>(node.resolveName("image") + "/compressed", kImageQueue, forward,
                                                     ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  } else {
    const image_transport::TransportHints hints(transport, ros::TransportHints().tcpNoDelay(), private_node);
    by_plugin_ = image_transport_.subscribe(
        "image", kImageQueue, [callback](const sensor_msgs::ImageConstPtr& message) { callback(received(message)); },
        ros::VoidPtr(), hints);
  }
  topic_ = compressed_ ? compressed_.getTopic() : by_plugin_.getTopic();
}

void ImageSource::shutdown() {
  by_plugin_.shutdown();
  compressed_.shutdown();
}

std::string ImageSource::description() {
  const unsigned publishers = compressed_ ? compressed_.getNumPublishers() : by_plugin_.getNumPublishers();
  const std::string words = topic() + " (publishers: " + std::to_string(publishers) + ")";
  if (publishers > 0) return words;
  return words + published_.hint(topic(), compressed_ ? "sensor_msgs/CompressedImage" : "sensor_msgs/Image");
}

StampMonitor::Verdict StampMonitor::judge(std::int64_t stamp_ns) {
  lag_s_ = 0.0;
  if (!newest_ns_ || stamp_ns >= *newest_ns_) {
    newest_ns_ = stamp_ns;
    late_ns_.reset();
    return Verdict::kInOrder;
  }
  lag_s_ = secondsBetween(stamp_ns, *newest_ns_);
  if (!late_ns_ || stamp_ns < *late_ns_) {
    late_ns_ = stamp_ns;
    return Verdict::kLate;
  }
  newest_ns_ = stamp_ns;
  late_ns_.reset();
  return Verdict::kWentBack;
}

void ImageWorker::start(const std::string& topic) {
  topic_ = topic;
  thread_ = std::thread(&ImageWorker::work, this);
}

void ImageWorker::stop() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

void ImageWorker::push(ReceivedImage image) {
  count(&ImageCounts::received);
  queue_.push(std::move(image));
}

ImageCounts ImageWorker::counts() const {
  const std::uint64_t dropped = queue_.dropped();  // first, so that no more images end than are received
  const std::lock_guard<std::mutex> lock(mutex_);
  ImageCounts counts = counts_;
  counts.dropped = dropped;
  return counts;
}

void ImageWorker::count(std::uint64_t ImageCounts::*images) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++(counts_.*images);
}

void ImageWorker::work() {
  while (const auto image = queue_.pop()) {
    guarded(log_, "image", [&] {
      if (const auto localized = localize(*image)) publish(*localized);
    });
  }
}

std::optional<LocalizedImage> ImageWorker::localize(const ReceivedImage& image) {
  try {
    requireUsableStamp(image.header.stamp);
    LocalizedImage localized{{}, image.header, !image.header.stamp.isZero(), image.decode()};
    if (!localizer_.hasMap()) {
      count(&ImageCounts::without_map);
      return std::nullopt;
    }
    if (localized.has_stamp && isLate(image.header.stamp)) {
      count(&ImageCounts::late);
      return std::nullopt;
    }
    if (!localized.has_stamp) {
      log_.warn("no stamp", "Images without a stamp: the time of processing is used");
      localized.header.stamp = ros::Time::now();
      requireUsableStamp(localized.header.stamp);
    }
    const auto stamp_ns = static_cast<std::int64_t>(localized.header.stamp.toNSec());
    localized.result = localizer_.process(stamp_ns, localized.grey).value();  // a map is never unloaded
    count(&ImageCounts::processed);
    return localized;
  } catch (const std::exception& error) {
    refuse(error.what());
    return std::nullopt;
  }
}

void ImageWorker::publish(const LocalizedImage& image) {
  const Estimate& estimate = image.result.estimate;
  if (!isFinite(estimate)) return log_.error("not finite", "The estimate is not finite and is not published");
  const std::string trouble = imageTrouble(estimate);
  if (!trouble.empty()) log_.warn("trouble", trouble + " (" + topic_ + ")");
  for (ImageOutput* output : outputs_) {
    try {
      output->publish(image, counts());
    } catch (const std::exception& error) {
      log_.error("not published",
                 "An image is localised, but not everything is published: " + std::string(error.what()));
    }
  }
}

bool ImageWorker::isLate(const ros::Time& stamp) {
  const auto verdict = stamps_.judge(static_cast<std::int64_t>(stamp.toNSec()));
  if (verdict == StampMonitor::Verdict::kInOrder) return false;
  std::ostringstream lag;
  lag << stamps_.lag_s() << " s";
  if (verdict == StampMonitor::Verdict::kLate) {
    log_.warn("late", "Late image left out: " + lag.str() + " older than the newest one (" + topic_ + ")");
    return true;
  }
  log_.warn("time went back", "Time went back by " + lag.str() + ", as when a bag starts again: continuing from there");
  for (ImageOutput* output : outputs_) output->timeWentBack();
  return false;
}

void ImageWorker::refuse(const std::string& reason) {
  count(&ImageCounts::refused);
  for (ImageOutput* output : outputs_) output->refused(reason);
  log_.warn("refused", "Image refused: " + reason);
}

}  // namespace visual_localization
