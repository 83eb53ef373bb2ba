/// Calibrations: messages, and files of camera_calibration. The first byte chooses.
#include <cstdint>
#include <optional>
#include <string>

#include <sensor_msgs/CameraInfo.h>

#include "bag/bag_messages.h"
#include "ros/message_readers.h"
#include "test/fuzz/fuzz_support.h"

namespace visual_localization {
namespace {

void requireUsable(const CameraModel& camera) {
  if (!camera.project(Eigen::Vector3d::UnitZ()).allFinite()) fuzz::fail("a camera that does not see ahead");
  fuzz::countRead();
}

void readMessage(const std::string& bytes, bool rectified) {
  fuzz::expect<ImageError>([&] {
    const auto info = deserialize<sensor_msgs::CameraInfo>(bytes);
    fuzz::expect<CameraError>([&] {
      const std::optional<CameraModel> camera = toCamera(*info, rectified);
      if (!camera) return;
      requireUsable(*camera);
      fuzz::mustNotThrow([&] {
        const std::optional<CameraModel> again = toCamera(toMessage(*camera));
        if (!again || *again != *camera) fuzz::fail("a camera that does not read back");
      });
    });
  });
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  if (size == 0) return 0;
  const std::string content = fuzz::Input(data + 1, size - 1).rest();
  if (data[0] == 'y') {
    fuzz::expect<CameraError>([&] { requireUsable(parseCameraFile(content, "camera.yaml")); });
  } else if (data[0] == 'i') {
    fuzz::expect<CameraError>([&] { requireUsable(parseCameraFile(content, "camera.ini")); });
  } else {
    readMessage(content, data[0] >= 128);
  }
  return 0;
}
