#include "visual_localization/bag/bag_reader.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <utility>

#include <sys/stat.h>

#include "bag/bag_messages.h"
#include "base/text.h"
#include "base/time.h"
#include "ros/message_readers.h"
#include "ros/static_transforms.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

void requireFile(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw BagError(path + ": " + std::strerror(errno));
  if (S_ISDIR(status.st_mode)) throw BagError(path + ": is a folder, not a bag");
  if (!S_ISREG(status.st_mode)) throw BagError(path + ": is not a regular file");
  if (status.st_size == 0) throw BagError(path + ": is empty");
}

template <class Message>
cv::Size claimedSize(const Message& message) {
  try {
    return sizeOf(message);
  } catch (const ImageError&) {
    return {};
  }
}

/// Two cameras on one topic make no map. `frame`: that of the images before.
void requireSame(std::string& frame, const std::string& other, const std::string& topic) {
  const std::string plain = withoutSlash(other);
  if (frame.empty()) frame = plain;
  if (plain.empty() || plain == frame) return;
  throw bag::UnsupportedBag("topic '" + topic + "' has images of two cameras, frames '" + frame + "' and '" + plain +
                            "': record each on a topic of its own");
}

template <class Message>
BagImage readImage(std::string bytes, const bag::Message& from, std::string& frame, const std::string& topic) {
  try {
    const auto message = deserialize<Message>(std::move(bytes));
    requireSame(frame, message->header.frame_id, topic);
    return {stampOf(message->header, from), [message] { return toGrey(*message); }, claimedSize(*message)};
  } catch (const ImageError& error) {
    return {from.stamp_ns, [error]() -> cv::Mat { throw error; }, {}};
  }
}

/// Throws CameraError when the messages do not say the same.
std::optional<CameraModel> singleCalibration(bag::BagFile& file, const std::vector<bag::Message>& messages,
                                             bool rectified) {
  SingleCalibration calibration(rectified);
  for (const bag::Message& message : messages) {
    if (calibration.add(*deserialize<sensor_msgs::CameraInfo>(file.read(message)))) continue;
    const double after_s = secondsBetween(messages.front().stamp_ns, message.stamp_ns);
    throw CameraError("the calibration changes " + std::to_string(std::llround(after_s)) +
                      " s after the first: cut the bag there, or name one that holds for all of it (--camera-info)");
  }
  return calibration.camera();
}

}  // namespace

struct BagImages::Content {
  std::string path;
  std::shared_ptr<bag::BagFile> file;
  std::string topic;
  bool is_compressed = false;
  std::vector<bag::Message> messages;
  mutable std::string frame;  ///< of the first image that has one
};

std::size_t BagImages::size() const { return content_->messages.size(); }

const std::string& BagImages::topic() const { return content_->topic; }

BagImage BagImages::read(std::size_t i) const {
  return withBag(content_->path, [&] {
    const bag::Message& message = content_->messages.at(i);
    std::string bytes = content_->file->read(message);
    const auto read_it =
        content_->is_compressed ? readImage<sensor_msgs::CompressedImage> : readImage<sensor_msgs::Image>;
    return read_it(std::move(bytes), message, content_->frame, content_->topic);
  });
}

cv::Size BagImages::usualSize() const {
  constexpr std::size_t kMostRead = 100;  // each unpacks its chunk of the bag
  std::map<std::pair<int, int>, std::size_t> counts;
  const std::size_t count = std::min(size(), kMostRead);
  for (std::size_t i = 0; i < count; ++i) {
    const cv::Size found = read(i * size() / count).size;
    if (!found.empty()) ++counts[{found.width, found.height}];
  }
  const auto usual =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return usual == counts.end() ? cv::Size() : cv::Size(usual->first.first, usual->first.second);
}

BagReader::BagReader(const std::string& path) : path_(path) {
  requireFile(path);
  file_ = withBag(path, [&] { return std::make_shared<bag::BagFile>(std::make_unique<bag::FileBytes>(path)); });
}

BagReader::BagReader(std::string name, std::unique_ptr<const bag::Bytes> bytes) : path_(std::move(name)) {
  file_ = withBag(path_, [&] { return std::make_shared<bag::BagFile>(std::move(bytes)); });
}

BagImages BagReader::images(const std::string& topic) const {
  return withBag(path_, [&] {
    auto content = std::make_shared<BagImages::Content>();
    content->path = path_;
    content->file = file_;
    content->topic = topic;
    const Topics compressed = topicsOf<sensor_msgs::CompressedImage>(*file_);
    if (topicsOf<sensor_msgs::Image>(*file_).count(topic) != 0) {
      if (compressed.count(topic) != 0) {
        throw BagError(path_ + ": topic '" + topic + "' has raw and compressed images; only one kind is allowed");
      }
      content->messages = messagesOf<sensor_msgs::Image>(*file_, topic);
      return BagImages(content);
    }
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
    try {
      return singleCalibration(*file_, messages, isRectified(image_topic));
    } catch (const CameraError& error) {
      throw BagError(path_ + ": " + oneLine(topic) + ": " + oneLine(error.what()));
    }
  });
}

bool BagReader::hasFixes(const std::string& topic) const {
  return withBag(path_, [&] { return topicsOf<sensor_msgs::NavSatFix>(*file_).count(topic) != 0; });
}

std::vector<OdometryReading> BagReader::odometry(const std::string& topic, const std::string& base_frame,
                                                 const std::string& map_frame) const {
  return withBag(path_, [&] {
    if (topicsOf<nav_msgs::Odometry>(*file_).count(topic) == 0) {
      throw BagError(path_ + ": no odometry topic '" + topic +
                     "'; odometry topics in this bag: " + listTopics<nav_msgs::Odometry>(*file_));
    }
    std::vector<OdometryReading> readings;
    for (const bag::Message& message : messagesOf<nav_msgs::Odometry>(*file_, topic)) {
      const auto reading = deserialize<nav_msgs::Odometry>(file_->read(message));
      try {
        readings.push_back(toReading(*reading, stampOf(reading->header, message), base_frame, map_frame));
      } catch (const std::invalid_argument& error) {
        throw BagError(path_ + ": " + oneLine(topic) + ": message " + std::to_string(readings.size()) + ": " +
                       error.what());
      }
    }
    return readings;
  });
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

namespace {

/// Images and calibrations begin with their header. Empty without messages.
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

}  // namespace

std::string BagReader::imageFrame(const std::string& topic) const {
  return withBag(path_, [&] {
    std::string frame = frameOf<sensor_msgs::Image>(*file_, topic);
    if (frame.empty()) frame = frameOf<sensor_msgs::CompressedImage>(*file_, topic);
    if (frame.empty()) frame = frameOf<sensor_msgs::CompressedImage>(*file_, topic + "/compressed");
    return frame.empty() ? frameOf<sensor_msgs::CameraInfo>(*file_, cameraInfoTopic(topic)) : frame;
  });
}

std::shared_ptr<const StaticTransforms> BagReader::transforms(bool published) const {
  return withBag(path_, [&]() -> std::shared_ptr<const StaticTransforms> {
    auto transforms = std::make_shared<StaticTransforms>();
    const auto messages = [&](const std::string& topic) {
      const bool has = topicsOf<tf2_msgs::TFMessage>(*file_).count(topic) != 0;
      return has ? messagesOf<tf2_msgs::TFMessage>(*file_, topic) : std::vector<bag::Message>();
    };
    for (const bag::Message& message : messages("/tf_static")) {
      transforms->add(*deserialize<tf2_msgs::TFMessage>(file_->read(message)));
    }
    for (const bag::Message& message : published ? messages("/tf") : std::vector<bag::Message>()) {
      transforms->addPublished(*deserialize<tf2_msgs::TFMessage>(file_->read(message)));
    }
    return transforms;
  });
}

}  // namespace visual_localization
