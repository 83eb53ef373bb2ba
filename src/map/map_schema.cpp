#include "map/map_schema.h"

#include <array>
#include <cstring>
#include <stdexcept>
#include <string>

#include <zlib.h>

namespace visual_localization::map_schema {
namespace {

std::uint64_t bitsOf(double value) {
  // SQLite does not keep the sign of zero.
  const double normal = value == 0.0 ? 0.0 : value;
  std::uint64_t bits = 0;
  std::memcpy(&bits, &normal, sizeof(bits));
  return bits;
}

}  // namespace

std::int64_t crc32Of(sqlite::Bytes bytes, std::int64_t previous) {
  // SQLite's own limit of 2 GiB a value keeps every size within zlib's 32 bits.
  if (bytes.size == 0) return previous;
  return static_cast<std::int64_t>(::crc32(static_cast<uLong>(previous), bytes.data, static_cast<uInt>(bytes.size)));
}

void Checksum::addRaw(const std::uint8_t* data, std::size_t size) {
  value_ = static_cast<std::uint32_t>(crc32Of({data, size}, value_));
}

void Checksum::add(std::int64_t value) {
  std::array<std::uint8_t, 8> bytes{};
  putLittleEndian(static_cast<std::uint64_t>(value), bytes.data());
  addRaw(bytes.data(), bytes.size());
}

void Checksum::add(double value) { add(static_cast<std::int64_t>(bitsOf(value))); }

void Checksum::add(const std::string& value) {
  add(static_cast<std::int64_t>(value.size()));
  addRaw(reinterpret_cast<const std::uint8_t*>(value.data()), value.size());
}

void Checksum::add(const ParameterValues& values) {
  add(static_cast<std::int64_t>(values.size()));
  for (const auto& [key, value] : values) {
    add(key);
    add(static_cast<std::int64_t>(value.index()));
    if (const auto* integer = std::get_if<std::int64_t>(&value)) add(*integer);
    if (const auto* real = std::get_if<double>(&value)) add(*real);
    if (const auto* text = std::get_if<std::string>(&value)) add(*text);
    // A switch would come back from SQLite as an integer.
    if (std::holds_alternative<bool>(value)) throw std::logic_error("map: '" + key + "' has no form in a map file");
  }
}

void ImageRow::addTo(Checksum& checksum) const {
  // At once: the checksum of a few bytes costs more than that of many.
  std::array<std::uint8_t, 56> bytes{};
  std::uint8_t* to = bytes.data();
  for (const std::int64_t value : {id, session, stamp_ns, feature_count}) {
    putLittleEndian(static_cast<std::uint64_t>(value), to);
    to += sizeof(value);
  }
  for (const double value : {east_m, north_m, yaw_rad}) {
    putLittleEndian(bitsOf(value), to);
    to += sizeof(value);
  }
  checksum.addRaw(bytes.data(), bytes.size());
}

ImageRow rowOf(const TrainingPoses& poses, std::size_t i) {
  const Eigen::Vector2d& position_m = poses.positions_m[i];
  return {static_cast<std::int64_t>(i),
          poses.sessions[i],
          poses.stamps_ns[i],
          position_m.x(),
          position_m.y(),
          poses.yaws_rad[i],
          poses.feature_counts[i]};
}

std::int64_t rowSeed(const ImageRow& image) {
  Checksum checksum;
  image.addTo(checksum);
  return checksum.value();
}

std::vector<std::uint32_t> rowSeeds(const TrainingPoses& poses) {
  std::vector<std::uint32_t> seeds(poses.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    seeds[i] = static_cast<std::uint32_t>(rowSeed(rowOf(poses, i)));
  }
  return seeds;
}

std::int64_t rowChecksum(std::int64_t seed, std::initializer_list<sqlite::Bytes> blobs) {
  std::int64_t checksum = seed;
  for (const sqlite::Bytes& blob : blobs) checksum = crc32Of(blob, checksum);
  return checksum;
}

}  // namespace visual_localization::map_schema
