#include "visual_localization/bag/bag_reader.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <memory>
#include <new>
#include <utility>

#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/NavSatFix.h>
#include <sys/stat.h>

#include "bag/bag_validator.h"
#include "base/text.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

/// Runs `read` and gives whatever it throws the path and one line.
template <class Read>
auto withBag(const std::string& path, Read read) {
  try {
    return read();
  } catch (const BagError&) {
    throw;
  } catch (const UnsupportedBag& error) {
    throw BagError(path + ": " + oneLine(error.what()));
  } catch (const DamagedBag& error) {
    throw BagError(path + ": bag is damaged or cut off: " + oneLine(error.what()));
  } catch (const rosbag::BagUnindexedException&) {
    throw BagError(path + ": bag is not indexed, as after an interrupted recording; `rosbag reindex` may repair it");
  } catch (const rosbag::BagIOException& error) {
    throw BagError(path + ": bag is damaged or cut off: " + oneLine(error.what()));
  } catch (const rosbag::BagFormatException& error) {
    throw BagError(path + ": not a readable bag: " + oneLine(error.what()));
  } catch (const std::bad_alloc&) {
    throw BagError(path + ": bag is damaged: it asks for more memory than there is");
  } catch (const std::exception& error) {
    throw BagError(path + ": bag is damaged: " + oneLine(error.what()));
  }
}

void requireFile(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw BagError(path + ": " + std::strerror(errno));
  if (S_ISDIR(status.st_mode)) throw BagError(path + ": is a folder, not a bag");
  if (!S_ISREG(status.st_mode)) throw BagError(path + ": is not a regular file");
  if (status.st_size == 0) throw BagError(path + ": is empty");
}

/// Topics by type, as far as the bag's connections tell.
using Topics = std::map<std::string, std::vector<const rosbag::ConnectionInfo*>>;

template <class Message>
Topics topicsOf(const rosbag::Bag& bag) {
  Topics topics;
  rosbag::View view(bag);
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    if (connection->datatype == ros::message_traits::datatype<Message>()) {
      topics[connection->topic].push_back(connection);
    }
  }
  return topics;
}

/// For error messages, the first few: "/a (sensor_msgs/Image), /b (sensor_msgs/CompressedImage)".
template <class... Messages>
std::string listTopics(const rosbag::Bag& bag) {
  constexpr std::size_t kLongestList = 1000;
  std::string list;
  const auto append = [&list](const Topics& topics, const std::string& type) {
    for (const auto& entry : topics) {
      if (list.size() > kLongestList) return;
      list += (list.empty() ? "" : ", ") + oneLine(entry.first) + " (" + type + ")";
    }
  };
  (append(topicsOf<Messages>(bag), ros::message_traits::datatype<Messages>()), ...);
  return list.empty() ? "none" : list;
}

/// All messages of one topic and type. A definition that is not ours is refused rather than misread.
template <class Message>
std::vector<rosbag::MessageInstance> messagesOf(const rosbag::Bag& bag, const std::string& topic) {
  const Topics topics = topicsOf<Message>(bag);
  for (const rosbag::ConnectionInfo* connection : topics.at(topic)) {
    if (connection->md5sum == ros::message_traits::md5sum<Message>()) continue;
    throw std::runtime_error("topic '" + topic + "' has another definition of " +
                             ros::message_traits::datatype<Message>() + " (md5 " + connection->md5sum + ")");
  }
  rosbag::View view(bag, [&topic](const rosbag::ConnectionInfo* connection) {
    return connection->topic == topic && connection->datatype == ros::message_traits::datatype<Message>();
  });
  std::vector<rosbag::MessageInstance> messages;
  messages.reserve(view.size());
  for (const rosbag::MessageInstance& message : view) messages.push_back(message);
  return messages;
}

/// Steps over a serialized message without allocating what its lengths claim.
class Cursor {
 public:
  explicit Cursor(const std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  Cursor& skip(std::uint64_t count) {
    if (count > bytes_.size() - at_) throw ImageError("message is broken: it is shorter than its lengths claim");
    at_ += static_cast<std::size_t>(count);
    return *this;
  }
  /// A string or an array of bytes: four bytes of length and then the content.
  Cursor& skipArray() {
    const std::size_t from = at_;
    skip(4);
    std::uint64_t length = 0;
    for (std::size_t i = 4; i > 0; --i) length = length * 256 + bytes_[from + i - 1];
    return skip(length);
  }

 private:
  const std::vector<std::uint8_t>& bytes_;
  std::size_t at_ = 0;
};

Cursor skipHeader(const std::vector<std::uint8_t>& bytes) { return Cursor(bytes).skip(12).skipArray(); }

void requireLengths(const std::vector<std::uint8_t>& bytes, const sensor_msgs::Image*) {
  skipHeader(bytes).skip(8).skipArray().skip(5).skipArray();
}

void requireLengths(const std::vector<std::uint8_t>& bytes, const sensor_msgs::CompressedImage*) {
  skipHeader(bytes).skipArray().skipArray();
}

void requireLengths(const std::vector<std::uint8_t>& bytes, const sensor_msgs::NavSatFix*) {
  skipHeader(bytes).skip(3 + 12 * 8 + 1);
}

/// Throws ImageError when the lengths inside the message do not fit.
template <class Message>
std::shared_ptr<const Message> deserialize(const rosbag::MessageInstance& instance) {
  std::vector<std::uint8_t> bytes(instance.size());
  ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  instance.write(out);
  requireLengths(bytes, static_cast<const Message*>(nullptr));
  auto message = std::make_shared<Message>();
  ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::deserialize(in, *message);
  return message;
}

std::int64_t nanoseconds(const ros::Time& time) { return std::int64_t{time.sec} * 1'000'000'000 + time.nsec; }

std::int64_t stampOf(const std_msgs::Header& header, const rosbag::MessageInstance& instance) {
  return nanoseconds(header.stamp.isZero() ? instance.getTime() : header.stamp);
}

template <class Message>
BagImage readImage(const rosbag::MessageInstance& instance) {
  try {
    const auto message = deserialize<Message>(instance);
    return {stampOf(message->header, instance), [message] { return toGrey(*message); }};
  } catch (const ImageError& error) {
    return {nanoseconds(instance.getTime()), [error]() -> cv::Mat { throw error; }};
  }
}

Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns) {
  return {stamp_ns,
          {message.latitude, message.longitude, message.altitude},
          message.status.status >= sensor_msgs::NavSatStatus::STATUS_FIX};
}

}  // namespace

BagImage BagImages::read(std::size_t i) const {
  return withBag(path_, [&] {
    const rosbag::MessageInstance& instance = messages_.at(i);
    return compressed_ ? readImage<sensor_msgs::CompressedImage>(instance) : readImage<sensor_msgs::Image>(instance);
  });
}

BagReader::BagReader(const std::string& path) : path_(path) {
  requireFile(path);
  withBag(path, [&] {
    validateBag(path);
    bag_.open(path, rosbag::bagmode::Read);
  });
}

BagImages BagReader::images(const std::string& topic) const {
  return withBag(path_, [&] {
    BagImages images;
    images.path_ = path_;
    images.topic_ = topic;
    if (topicsOf<sensor_msgs::Image>(bag_).count(topic) != 0) {
      images.messages_ = messagesOf<sensor_msgs::Image>(bag_, topic);
      return images;
    }
    const Topics compressed = topicsOf<sensor_msgs::CompressedImage>(bag_);
    if (compressed.count(topic) == 0) images.topic_ = topic + "/compressed";
    if (compressed.count(images.topic_) == 0) {
      throw BagError(path_ + ": no image topic '" + topic + "' or '" + images.topic_ + "'; image topics in this bag: " +
                     listTopics<sensor_msgs::Image, sensor_msgs::CompressedImage>(bag_));
    }
    images.compressed_ = true;
    images.messages_ = messagesOf<sensor_msgs::CompressedImage>(bag_, images.topic_);
    return images;
  });
}

std::vector<Fix> BagReader::fixes(const std::string& topic) const {
  return withBag(path_, [&] {
    if (topicsOf<sensor_msgs::NavSatFix>(bag_).count(topic) == 0) {
      throw BagError(path_ + ": no fix topic '" + topic +
                     "'; fix topics in this bag: " + listTopics<sensor_msgs::NavSatFix>(bag_));
    }
    std::vector<Fix> fixes;
    for (const rosbag::MessageInstance& instance : messagesOf<sensor_msgs::NavSatFix>(bag_, topic)) {
      const auto message = deserialize<sensor_msgs::NavSatFix>(instance);
      fixes.push_back(toFix(*message, stampOf(message->header, instance)));
    }
    return fixes;
  });
}

}  // namespace visual_localization
