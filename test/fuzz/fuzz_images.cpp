/// Messages as anyone on the network may send them. The first byte chooses the type.
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <vector>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/serialization.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include "features/image_size.h"
#include "node/shared_localizer.h"
#include "test/fuzz/fuzz_support.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

/// Whether every array, of one byte an element, lies within the bytes: roscpp allocates what a length claims before it
/// looks whether so much follows, and that is not ours to mend. `gaps`: bytes before each array.
bool arraysFit(const std::vector<std::uint8_t>& bytes, std::initializer_list<std::size_t> gaps) {
  std::uint64_t at = 0;
  for (const std::size_t gap : gaps) {
    at += gap;
    if (at + 4 > bytes.size()) return false;
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data() + at, sizeof(length));
    at += 4 + std::uint64_t{length};
  }
  return at <= bytes.size();
}

/// A message as roscpp makes it of what arrives, unless roscpp itself refuses it.
template <class Message>
std::optional<Message> deserialised(std::vector<std::uint8_t> bytes, std::initializer_list<std::size_t> gaps) {
  if (!arraysFit(bytes, gaps)) return std::nullopt;
  try {
    Message message;
    ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(in, message);
    return message;
  } catch (const ros::serialization::StreamOverrunException&) {
    return std::nullopt;
  }
}

void requireImage(const cv::Mat& grey) {
  if (grey.empty() || grey.type() != CV_8UC1) fuzz::fail("no grey image");
  if (whyTooLarge(grey.size())) fuzz::fail("an image that is too large");
}

void convert(const sensor_msgs::Image& message) {
  fuzz::expect<ImageError>([&] {
    const cv::Mat grey = toGrey(message);
    requireImage(grey);
    if (grey.size() != cv::Size(static_cast<int>(message.width), static_cast<int>(message.height))) {
      fuzz::fail("an image of another size");
    }
  });
}

void convert(const sensor_msgs::CompressedImage& message) {
  fuzz::expect<ImageError>([&] { requireImage(toGrey(message)); });
}

void usePose(const geometry_msgs::PoseWithCovarianceStamped& pose) {
  fuzz::expect<std::invalid_argument>([&] {
    const SharedLocalizer::Guess guess = guessFrom(pose, "map");
    if (!guess.mean_m.allFinite() || !guess.covariance_m2.allFinite()) fuzz::fail("a guess that is not finite");
    normallyDistributed(guess.mean_m, guess.covariance_m2);
  });
  const auto& position = pose.pose.pose.position;
  fuzz::expect<std::invalid_argument>([&] { around({position.x, position.y}, position.z); });
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  if (size == 0) return 0;
  const std::vector<std::uint8_t> bytes(data + 1, data + size);
  constexpr std::size_t kHeader = 12;  // of std_msgs/Header before its frame
  switch (data[0] % 3) {
    case 0:
      if (const auto image = deserialised<sensor_msgs::Image>(bytes, {kHeader, 8, 5})) convert(*image);
      break;
    case 1:
      if (const auto image = deserialised<sensor_msgs::CompressedImage>(bytes, {kHeader, 0, 0})) convert(*image);
      break;
    default:
      if (const auto pose = deserialised<geometry_msgs::PoseWithCovarianceStamped>(bytes, {kHeader})) usePose(*pose);
  }
  return 0;
}
