/// Raw and compressed images, and masks; the first byte chooses.
#include <cstdint>
#include <string>

#include <opencv2/core.hpp>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include "bag/bag_messages.h"
#include "features/image_size.h"
#include "test/fuzz/fuzz_support.h"
#include "visual_localization/camera/mask.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

void requireImage(const cv::Mat& grey, const cv::Size& size) {
  if (grey.empty() || grey.type() != CV_8UC1) fuzz::fail("no grey image");
  if (whyTooLarge(grey.size())) fuzz::fail("an image that is too large");
  if (grey.size() != size) fuzz::fail("an image of another size than its header says");
  fuzz::countRead();
}

template <class Message>
void convert(const Message& message) {
  const cv::Size size = sizeOf(message);
  requireImage(toGrey(message), size);
}

void requireMask(const Mask& mask) {
  if (mask.empty() || mask.usedShare() <= 0.0) fuzz::fail("a mask that uses nothing");
  fuzz::countRead();
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  if (size == 0) return 0;
  if (data[0] == 'M') {
    const std::string path = fuzz::inMemoryFile(data + 1, size - 1);
    fuzz::expect<CameraError>([&] { requireMask(readMask(path)); });
    return 0;
  }
  const std::string bytes = fuzz::Input(data + 1, size - 1).rest();
  fuzz::expect<ImageError>([&] {
    if (data[0] % 2 == 0) {
      convert(*deserialize<sensor_msgs::Image>(bytes));
    } else {
      convert(*deserialize<sensor_msgs::CompressedImage>(bytes));
    }
  });
  return 0;
}
