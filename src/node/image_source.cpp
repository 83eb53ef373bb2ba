#include "node/image_source.h"

#include <set>
#include <utility>

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include "base/text.h"
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

std::string ImageSource::description() const {
  const unsigned publishers = compressed_ ? compressed_.getNumPublishers() : by_plugin_.getNumPublishers();
  return topic() + " (publishers: " + std::to_string(publishers) + ")";
}

}  // namespace visual_localization
