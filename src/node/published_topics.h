#pragma once

#include <future>
#include <map>
#include <string>

namespace visual_localization {

/// Published topics, by name.
using TopicTypes = std::map<std::string, std::string>;

/// Why nobody publishes images of `type` on `topic`: another type, a suffix too many, or another transport. Empty when
/// nothing helps.
std::string topicHint(const std::string& topic, const std::string& type, const TopicTypes& published);

/// Asks the master for them. In a thread of its own: one that does not answer holds nobody up.
class PublishedTopics {
 public:
  /// By the last answer; asks for the next one.
  std::string hint(const std::string& topic, const std::string& type);

 private:
  std::future<TopicTypes> answer_;
  TopicTypes known_;
};

}  // namespace visual_localization
