#include <cmath>

#include <tf2/buffer_core.h>
#include <tf2_eigen/tf2_eigen.h>

#include "bag/bag_messages.h"
#include "ros/message_readers.h"

namespace visual_localization {
namespace {

/// Both kinds of images and fixes begin with their header. Empty without messages.
std::string frameOf(bag::BagFile& file, const std::set<std::uint32_t>& connections) {
  const std::vector<bag::Message> messages = file.messages(connections);
  if (messages.empty()) return {};
  std::string bytes = file.read(messages.front());
  skipHeader(bytes);
  std_msgs::Header header;
  ros::serialization::IStream in(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                 static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::deserialize(in, header);
  return header.frame_id;
}

template <class Message>
std::string frameOf(bag::BagFile& file, const std::string& topic) {
  const Topics topics = topicsOf<Message>(file);
  const auto found = topics.find(topic);
  return found == topics.end() ? std::string() : frameOf(file, found->second);
}

std::string imageFrame(bag::BagFile& file, const std::string& topic) {
  const std::string raw = frameOf<sensor_msgs::Image>(file, topic);
  if (!raw.empty()) return raw;
  const std::string compressed = frameOf<sensor_msgs::CompressedImage>(file, topic);
  return compressed.empty() ? frameOf<sensor_msgs::CompressedImage>(file, topic + "/compressed") : compressed;
}

}  // namespace

std::optional<SensorMount> BagReader::mount(const std::string& image_topic, const std::string& fix_topic,
                                            const std::string& base_frame) const {
  return withBag(path_, [&]() -> std::optional<SensorMount> {
    const std::string topic = "/tf_static";
    if (topicsOf<tf2_msgs::TFMessage>(*file_).count(topic) == 0) return std::nullopt;
    StaticTransforms transforms;
    for (const bag::Message& message : messagesOf<tf2_msgs::TFMessage>(*file_, topic)) {
      transforms.add(*deserialize<tf2_msgs::TFMessage>(file_->read(message)));
    }
    const auto camera = transforms.pose(base_frame, imageFrame(*file_, image_topic));
    const auto antenna = transforms.pose(base_frame, frameOf<sensor_msgs::NavSatFix>(*file_, fix_topic));
    if (!camera && !antenna) return std::nullopt;
    SensorMount mount;
    if (camera) mount.camera = {Eigen::Quaterniond(camera->linear()).normalized(), camera->translation()};
    mount.antenna_m = antenna ? Eigen::Vector3d(antenna->translation()) : mount.camera.position_m;
    try {
      requireMount(mount);
    } catch (const MountError& error) {
      throw BagError(path_ + ": " + topic + ": " + error.what());
    }
    return mount;
  });
}

}  // namespace visual_localization
