/// Structure, fixes, odometry and images, camera and mounting.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "bag/bag_file.h"
#include "bag/recorded_mount.h"
#include "test/fuzz/fuzz_support.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

void readImages(const BagReader& bag, const std::string& topic) {
  constexpr std::size_t kMost = 8;
  const BagImages images = bag.images(topic);
  for (std::size_t i = 0; i < images.size() && i < kMost; ++i) {
    fuzz::expect<ImageError>([&] { images.read(i).decode(), fuzz::countRead(); });
  }
}

void readCamera(const BagReader& bag, const std::string& topic) {
  const std::optional<CameraModel> camera = bag.camera(topic);
  if (camera && !camera->project(Eigen::Vector3d::UnitZ()).allFinite()) fuzz::fail("a camera that does not see ahead");
  if (camera) fuzz::countRead();
}

void readMount(const BagReader& bag, const std::string& topic) {
  const std::optional<RobotMount> found = recordedMount(bag, {"base_link", topic, "gps"});
  if (!found) return;
  requireMount(found->mount);
  fuzz::countRead();
}

template <class Readings>
void countUnlessEmpty(const Readings& readings) {
  if (!readings.empty()) fuzz::countRead();
}

void readTopic(const BagReader& bag, const std::string& topic) {
  fuzz::expect<BagError>([&] { readImages(bag, topic); });
  fuzz::expect<BagError>([&] { readCamera(bag, topic); });
  fuzz::expect<BagError>([&] { readMount(bag, topic); });
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  fuzz::expect<BagError>([&] {
    const BagReader bag("fuzz.bag", std::make_unique<bag::MemoryBytes>(fuzz::Input(data, size).rest()));
    fuzz::expect<BagError>([&] { countUnlessEmpty(bag.fixes("/fix")); });
    for (const char* topic : {"/fix", "/odom"}) {
      fuzz::expect<BagError>([&] { countUnlessEmpty(bag.receivers(topic)); });
    }
    fuzz::expect<BagError>([&] { countUnlessEmpty(bag.odometry("/odom", "base_link", "map")); });
    for (const char* topic : {"/raw", "/jpeg"}) readTopic(bag, topic);
  });
  return 0;
}
