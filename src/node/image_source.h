#pragma once

#include <functional>
#include <string>

#include <image_transport/image_transport.h>
#include <opencv2/core.hpp>
#include <ros/node_handle.h>
#include <std_msgs/Header.h>

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

  /// Subscribes to `image` of `node`. `transport` compressed means `<image>/compressed`, decoded here, for
  /// which no plugin is needed. Throws ParameterError when there is no such transport.
  ImageSource(ros::NodeHandle node, const ros::NodeHandle& private_node, const std::string& transport,
              Callback callback);

  /// Returns after a callback that is running.
  void shutdown();
  const std::string& topic() const { return topic_; }
  /// For people: the topic and how many publish it.
  std::string description() const;

 private:
  image_transport::ImageTransport image_transport_;
  image_transport::Subscriber by_plugin_;
  ros::Subscriber compressed_;
  std::string topic_;  ///< kept, because a subscriber that is shut down has none
};

}  // namespace visual_localization
