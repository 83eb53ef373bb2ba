#pragma once

#include <future>
#include <map>
#include <string>

namespace visual_localization {

/// Types of topics that somebody publishes, by name.
using TopicTypes = std::map<std::string, std::string>;

/// What helps whoever waits for images of `type` on `topic`, behind the words that nobody publishes them: that it is of
/// another type, that its name has a suffix too many, or that the transport is another. Empty when nothing does.
std::string topicHint(const std::string& topic, const std::string& type, const TopicTypes& published);

/// Asks the master for them. In a thread of its own: one that does not answer holds nobody up.
class PublishedTopics {
 public:
  /// topicHint() by the last answer; asks for the next one.
  std::string hint(const std::string& topic, const std::string& type);

 private:
  std::future<TopicTypes> answer_;
  TopicTypes known_;
};

}  // namespace visual_localization
