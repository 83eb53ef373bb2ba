#include "visual_localization/bag/bag_reader.h"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <new>
#include <set>
#include <string_view>
#include <utility>

#include <ros/serialization.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/NavSatFix.h>
#include <sys/stat.h>

#include "bag/bag_file.h"
#include "base/text.h"
#include "base/time.h"
#include "ros/camera_info.h"
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
  } catch (const bag::UnsupportedBag& error) {
    throw BagError(path + ": " + oneLine(error.what()));
  } catch (const bag::DamagedBag& error) {
    throw BagError(path + ": bag is damaged or cut off: " + oneLine(error.what()));
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

/// For error messages, the first few: "/a (sensor_msgs/Image), /b (sensor_msgs/CompressedImage)".
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

/// All messages of one topic and type. A definition that is not ours is refused rather than misread.
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
  /// A string or an array: four bytes of length and then as many elements of `element_bytes`.
  Cursor& skipArray(std::uint64_t element_bytes = 1) {
    const std::size_t from = at_;
    skip(4);
    return skip(element_bytes * bag::numberAt(bytes_, from, 4));
  }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

Cursor skipHeader(std::string_view bytes) { return Cursor(bytes).skip(12).skipArray(); }

void requireLengths(std::string_view bytes, const sensor_msgs::Image*) {
  skipHeader(bytes).skip(8).skipArray().skip(5).skipArray();
}

void requireLengths(std::string_view bytes, const sensor_msgs::CompressedImage*) {
  skipHeader(bytes).skipArray().skipArray();
}

void requireLengths(std::string_view bytes, const sensor_msgs::NavSatFix*) { skipHeader(bytes).skip(3 + 12 * 8 + 1); }

void requireLengths(std::string_view bytes, const sensor_msgs::CameraInfo*) {
  constexpr std::uint64_t kMatrices = (9 + 9 + 12) * sizeof(double);
  constexpr std::uint64_t kBinning = 2 * 4;
  constexpr std::uint64_t kRegion = 4 * 4 + 1;
  skipHeader(bytes).skip(8).skipArray().skipArray(sizeof(double)).skip(kMatrices + kBinning + kRegion);
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

std::int64_t stampOf(const std_msgs::Header& header, const bag::Message& message) {
  if (header.stamp.isZero()) return message.stamp_ns;
  return std::int64_t{header.stamp.sec} * 1'000'000'000 + header.stamp.nsec;
}

template <class Message>
BagImage readImage(std::string bytes, const bag::Message& from) {
  try {
    const auto message = deserialize<Message>(std::move(bytes));
    return {stampOf(message->header, from), [message] { return toGrey(*message); }};
  } catch (const ImageError& error) {
    return {from.stamp_ns, [error]() -> cv::Mat { throw error; }};
  }
}

/// East and north of the covariance that the receiver claims, per axis; 0 when it claims none, or what cannot be.
double sigmaOf(const sensor_msgs::NavSatFix& message) {
  if (message.position_covariance_type == sensor_msgs::NavSatFix::COVARIANCE_TYPE_UNKNOWN) return 0.0;
  const double variance_m2 = 0.5 * (message.position_covariance[0] + message.position_covariance[4]);
  return std::isfinite(variance_m2) && variance_m2 > 0.0 ? std::sqrt(variance_m2) : 0.0;
}

Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns) {
  return {stamp_ns,
          {message.latitude, message.longitude, message.altitude},
          message.status.status >= sensor_msgs::NavSatStatus::STATUS_FIX,
          sigmaOf(message)};
}

/// That of all these messages. Throws std::runtime_error when they do not say the same.
sensor_msgs::CameraInfo onlyCalibration(bag::BagFile& file, const std::vector<bag::Message>& messages) {
  const auto first = deserialize<sensor_msgs::CameraInfo>(file.read(messages.front()));
  for (const bag::Message& message : messages) {
    const auto info = deserialize<sensor_msgs::CameraInfo>(file.read(message));
    if (sameCalibration(*info, *first)) continue;
    const double after_s = secondsBetween(messages.front().stamp_ns, message.stamp_ns);
    throw CameraError("the calibration changes " + std::to_string(std::llround(after_s)) +
                      " s after the first: cut the bag there, or name one that holds for all of it (--camera-info)");
  }
  return *first;
}

}  // namespace

struct BagImages::Content {
  std::string path;
  std::shared_ptr<bag::BagFile> file;
  std::string topic;
  bool is_compressed = false;
  std::vector<bag::Message> messages;
};

std::size_t BagImages::size() const { return content_->messages.size(); }

const std::string& BagImages::topic() const { return content_->topic; }

BagImage BagImages::read(std::size_t i) const {
  return withBag(content_->path, [&] {
    const bag::Message& message = content_->messages.at(i);
    std::string bytes = content_->file->read(message);
    return content_->is_compressed ? readImage<sensor_msgs::CompressedImage>(std::move(bytes), message)
                                   : readImage<sensor_msgs::Image>(std::move(bytes), message);
  });
}

BagReader::BagReader(const std::string& path) : path_(path) {
  requireFile(path);
  file_ = withBag(path, [&] { return std::make_shared<bag::BagFile>(path); });
}

BagImages BagReader::images(const std::string& topic) const {
  return withBag(path_, [&] {
    auto content = std::make_shared<BagImages::Content>();
    content->path = path_;
    content->file = file_;
    content->topic = topic;
    if (topicsOf<sensor_msgs::Image>(*file_).count(topic) != 0) {
      content->messages = messagesOf<sensor_msgs::Image>(*file_, topic);
      return BagImages(content);
    }
    const Topics compressed = topicsOf<sensor_msgs::CompressedImage>(*file_);
    if (compressed.count(topic) == 0) content->topic = topic + "/compressed";
    if (compressed.count(content->topic) == 0) {
      throw BagError(
          path_ + ": no image topic '" + topic + "' or '" + content->topic +
          "'; image topics in this bag: " + listTopics<sensor_msgs::Image, sensor_msgs::CompressedImage>(*file_));
    }
    content->is_compressed = true;
    content->messages = messagesOf<sensor_msgs::CompressedImage>(*file_, content->topic);
    return BagImages(content);
  });
}

std::optional<CameraModel> BagReader::camera(const std::string& image_topic) const {
  const std::string topic = cameraInfoTopic(image_topic);
  return withBag(path_, [&]() -> std::optional<CameraModel> {
    if (topicsOf<sensor_msgs::CameraInfo>(*file_).count(topic) == 0) return std::nullopt;
    const std::vector<bag::Message> messages = messagesOf<sensor_msgs::CameraInfo>(*file_, topic);
    if (messages.empty()) return std::nullopt;
    try {
      return toCamera(onlyCalibration(*file_, messages), isRectified(image_topic));
    } catch (const CameraError& error) {
      throw BagError(path_ + ": " + oneLine(topic) + ": " + oneLine(error.what()));
    }
  });
}

bool BagReader::hasFixes(const std::string& topic) const {
  return withBag(path_, [&] { return topicsOf<sensor_msgs::NavSatFix>(*file_).count(topic) != 0; });
}

std::vector<Fix> BagReader::fixes(const std::string& topic) const {
  return withBag(path_, [&] {
    if (!hasFixes(topic)) {
      throw BagError(path_ + ": no fix topic '" + topic +
                     "'; fix topics in this bag: " + listTopics<sensor_msgs::NavSatFix>(*file_));
    }
    std::vector<Fix> fixes;
    for (const bag::Message& message : messagesOf<sensor_msgs::NavSatFix>(*file_, topic)) {
      const auto fix = deserialize<sensor_msgs::NavSatFix>(file_->read(message));
      fixes.push_back(toFix(*fix, stampOf(fix->header, message)));
    }
    return fixes;
  });
}

}  // namespace visual_localization
