#include "node/published_topics.h"

#include <chrono>

#include <ros/master.h>

#include "base/text.h"

namespace visual_localization {
namespace {

const std::string kSuffix = "/compressed";

bool hasSuffix(const std::string& topic) {
  return topic.size() > kSuffix.size() && topic.compare(topic.size() - kSuffix.size(), kSuffix.size(), kSuffix) == 0;
}

std::string withoutSuffix(std::string topic) {
  while (hasSuffix(topic)) topic.resize(topic.size() - kSuffix.size());
  return topic;
}

TopicTypes publishedTopics() {
  ros::master::V_TopicInfo topics;
  ros::master::getTopics(topics);
  TopicTypes types;
  for (const ros::master::TopicInfo& topic : topics) types[topic.name] = topic.datatype;
  return types;
}

std::string settingFor(const std::string& topic, const std::string& type) {
  if (type == "sensor_msgs/Image") return ": set image to " + topic + " and image_transport to raw";
  if (type != "sensor_msgs/CompressedImage") return {};
  return hasSuffix(topic) ? ": set image to " + withoutSuffix(topic) + " and image_transport to compressed"
                          : ": its name must end in " + kSuffix;
}

}  // namespace

std::string topicHint(const std::string& topic, const std::string& type, const TopicTypes& published) {
  const auto found = published.find(topic);
  if (found != published.end() && found->second == type) return {};
  const std::string base = withoutSuffix(topic);
  for (const std::string& name : {topic, base + kSuffix, base}) {
    const auto candidate = published.find(name);
    if (candidate == published.end()) continue;
    return "; " + oneLine(name + " is of type " + candidate->second + settingFor(name, candidate->second));
  }
  return hasSuffix(topic) && hasSuffix(topic.substr(0, topic.size() - kSuffix.size()))
             ? "; the name ends in " + kSuffix + " twice: set image to " + oneLine(base)
             : std::string();
}

std::string PublishedTopics::hint(const std::string& topic, const std::string& type) {
  if (answer_.valid() && answer_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    known_ = answer_.get();
  }
  if (!answer_.valid()) answer_ = std::async(std::launch::async, publishedTopics);
  return topicHint(topic, type, known_);
}

}  // namespace visual_localization
