#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <new>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <nav_msgs/Odometry.h>
#include <ros/serialization.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>

#include "bag/bag_file.h"
#include "base/text.h"
#include "visual_localization/bag/bag_reader.h"

namespace visual_localization {

/// Gives whatever `read` throws the path and one line.
template <class Read>
auto withBag(const std::string& path, Read read) {
  try {
    return read();
  } catch (const BagError&) {
    throw;
  } catch (const bag::UnsupportedBag& error) {
    throw BagError(path + ": " + oneLine(error.what()));
  } catch (const bag::DamagedBag& error) {
    throw BagError(path + ": bag is damaged or cut off: " + oneLine(error.what()));
  } catch (const std::bad_alloc&) {
    throw BagError(path + ": there is not enough memory to read it, or it is damaged and asks for too much");
  } catch (const std::exception& error) {
    throw BagError(path + ": bag is damaged: " + oneLine(error.what()));
  }
}

/// The connections of each topic of one message type.
using Topics = std::map<std::string, std::set<std::uint32_t>>;

template <class Message>
Topics topicsOf(const bag::BagFile& file) {
  Topics topics;
  for (const auto& [id, connection] : file.connections()) {
    if (connection.type == ros::message_traits::datatype<Message>()) topics[connection.topic].insert(id);
  }
  return topics;
}

/// The first few: "/a (sensor_msgs/Image), /b (sensor_msgs/CompressedImage)".
template <class... Messages>
std::string listTopics(const bag::BagFile& file) {
  constexpr std::size_t kLongestList = 1000;
  std::string list;
  const auto append = [&list](const Topics& topics, const std::string& type) {
    for (const auto& entry : topics) {
      if (list.size() > kLongestList) return;
      list += (list.empty() ? "" : ", ") + oneLine(entry.first) + " (" + type + ")";
    }
  };
  (append(topicsOf<Messages>(file), ros::message_traits::datatype<Messages>()), ...);
  return list.empty() ? "none" : list;
}

/// A definition that is not ours is refused rather than misread.
template <class Message>
std::vector<bag::Message> messagesOf(const bag::BagFile& file, const std::string& topic) {
  const std::set<std::uint32_t> connections = topicsOf<Message>(file).at(topic);
  for (const std::uint32_t id : connections) {
    const std::string& md5sum = file.connections().at(id).md5sum;
    if (md5sum == ros::message_traits::md5sum<Message>()) continue;
    throw std::runtime_error("topic '" + topic + "' has another definition of " +
                             ros::message_traits::datatype<Message>() + " (md5 " + md5sum + ")");
  }
  return file.messages(connections);
}

/// Steps over a serialized message without allocating what its lengths claim.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : bytes_(bytes) {}

  Cursor& skip(std::uint64_t count) {
    if (count > bytes_.size() - at_) throw ImageError("message is broken: it is shorter than its lengths claim");
    at_ += static_cast<std::size_t>(count);
    return *this;
  }
  /// Four bytes of length and then as many elements.
  Cursor& skipArray(std::uint64_t element_bytes = 1) {
    const std::size_t from = at_;
    skip(4);
    return skip(element_bytes * bag::numberAt(bytes_, from, 4));
  }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

inline Cursor skipHeader(std::string_view bytes) { return Cursor(bytes).skip(12).skipArray(); }

inline void requireLengths(std::string_view bytes, const sensor_msgs::Image*) {
  skipHeader(bytes).skip(8).skipArray().skip(5).skipArray();
}

inline void requireLengths(std::string_view bytes, const sensor_msgs::CompressedImage*) {
  skipHeader(bytes).skipArray().skipArray();
}

inline void requireLengths(std::string_view bytes, const sensor_msgs::NavSatFix*) {
  skipHeader(bytes).skip(3 + 12 * 8 + 1);
}

inline void requireLengths(std::string_view bytes, const sensor_msgs::CameraInfo*) {
  constexpr std::uint64_t kMatrices = (9 + 9 + 12) * sizeof(double);
  constexpr std::uint64_t kBinning = 2 * 4;
  constexpr std::uint64_t kRegion = 4 * 4 + 1;
  skipHeader(bytes).skip(8).skipArray().skipArray(sizeof(double)).skip(kMatrices + kBinning + kRegion);
}

inline void requireLengths(std::string_view bytes, const nav_msgs::Odometry*) {
  constexpr std::uint64_t kPose = (7 + 36) * sizeof(double);
  constexpr std::uint64_t kTwist = (6 + 36) * sizeof(double);
  skipHeader(bytes).skipArray().skip(kPose + kTwist);
}

inline void requireLengths(std::string_view bytes, const tf2_msgs::TFMessage*) {
  constexpr std::uint64_t kTransform = 7 * sizeof(double);
  Cursor cursor(bytes);
  cursor.skip(4);
  for (std::uint64_t left = bag::numberAt(bytes, 0, 4); left > 0; --left) {
    cursor.skip(12).skipArray().skipArray().skip(kTransform);
  }
}

/// Throws ImageError when the lengths inside the message do not fit.
template <class Message>
std::shared_ptr<const Message> deserialize(std::string bytes) {
  requireLengths(bytes, static_cast<const Message*>(nullptr));
  auto message = std::make_shared<Message>();
  ros::serialization::IStream in(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                 static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::deserialize(in, *message);
  return message;
}

inline std::int64_t stampOf(const std_msgs::Header& header, const bag::Message& message) {
  if (header.stamp.isZero()) return message.stamp_ns;
  return std::int64_t{header.stamp.sec} * 1'000'000'000 + header.stamp.nsec;
}

}  // namespace visual_localization
