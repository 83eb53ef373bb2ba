/// The smallest parts of bags and maps: headers of records, and the blobs of a map's rows. The first byte chooses.
#include <cstdint>
#include <stdexcept>
#include <string>

#include <opencv2/core.hpp>

#include "bag/bag_file.h"
#include "map/map_schema.h"
#include "test/fuzz/fuzz_support.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

/// What can be read can be written, and reads back as the same.
void requireRepeatable(const ImageGeometry& geometry, std::size_t features) {
  const map_schema::PackedGeometry packed = map_schema::packGeometry(geometry, features);
  const ImageGeometry again = map_schema::unpackGeometry({packed.pose.data(), packed.pose.size()},
                                                         {packed.points.data(), packed.points.size()}, features);
  const map_schema::PackedGeometry twice = map_schema::packGeometry(again, features);
  if (twice.pose != packed.pose || twice.points != packed.points) fuzz::fail("landmarks that do not read back");
}

void readGeometry(fuzz::Input input) {
  const std::size_t features = input.number<std::uint16_t>();
  const std::string blobs = input.rest();
  const std::size_t pose = std::min(blobs.size(), map_schema::kPoseBytes);
  const auto* data = reinterpret_cast<const std::uint8_t*>(blobs.data());
  const ImageGeometry geometry = map_schema::unpackGeometry({data, pose}, {data + pose, blobs.size() - pose}, features);
  if (!geometry.camera.ahead().allFinite() || !geometry.covariance.allFinite()) fuzz::fail("a camera is nowhere");
  fuzz::mustNotThrow([&] { requireRepeatable(geometry, features); });
}

void readRecords(const std::string& content) {
  const bag::MemoryBytes bytes(content);
  bag::Range range{0, bytes.size()};
  while (range.begin < range.end) {
    const bag::Record record = bag::readRecord(bytes, range);
    if (record.data.end <= range.begin || record.data.end > range.end) fuzz::fail("a record beyond its range");
    range.begin = record.data.end;
  }
}

void readMask(fuzz::Input input) {
  const cv::Size size(input.number<std::uint8_t>() + 1, input.number<std::uint8_t>() + 1);
  const std::string bits = input.rest();
  const Mask mask = map_schema::unpackMask({reinterpret_cast<const std::uint8_t*>(bits.data()), bits.size()}, size);
  if (map_schema::packMask(mask).size() != bits.size()) fuzz::fail("a mask that does not read back");
}

template <class Refusal, class Read>
void readPart(Read read) {
  if (fuzz::expect<Refusal>(read)) fuzz::countRead();
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  if (size == 0) return 0;
  const fuzz::Input input(data + 1, size - 1);
  const sqlite::Bytes blob{data + 1, size - 1};
  switch (data[0] % 7) {
    case 0:
      readPart<bag::DamagedBag>([&] { bag::readFields(input.rest()); });
      break;
    case 1:
      readPart<bag::DamagedBag>([&] { readRecords(input.rest()); });
      break;
    case 2:
      readPart<std::runtime_error>([&] { readGeometry(input); });
      break;
    case 3:
      readPart<std::runtime_error>([&] { map_schema::unpackKeypoints(blob); });
      break;
    case 4:
      readPart<std::runtime_error>([&] { map_schema::unpackHistogram(blob); });
      break;
    case 5:
      readPart<std::runtime_error>([&] { readMask(input); });
      break;
    default:
      readPart<ImageError>([&] { compressedSize({data + 1, data + size}); });
  }
  return 0;
}
