#include "map/map_schema.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <utility>

#include <zlib.h>

#include "map/little_endian.h"
#include "map/packed_geometry.h"

namespace visual_localization::map_schema {
namespace {

constexpr const char* kCamera = "/camera/";  ///< behind the key of the session
constexpr const char* kMount = "/mount/";    ///< likewise
constexpr const char* kMask = "/mask";
constexpr const char* kGeometryCount = "geometry/images";

static_assert(kPoseBytes + kMaxFeaturesPerImage * landmarkBytes(kMaxFeaturesPerImage) <= kMaxRowBytes);

/// Of every version, in order of name.
constexpr std::array<Table, 7> kTables{{
    {"features",
     "CREATE TABLE features(image INTEGER PRIMARY KEY, keypoints BLOB NOT NULL, descriptors BLOB NOT NULL, "
     "crc32 INTEGER NOT NULL)"},
    {"globals",
     "CREATE TABLE globals(image INTEGER PRIMARY KEY, wgoh BLOB NOT NULL, wgii BLOB NOT NULL, crc32 INTEGER NOT NULL)"},
    {"images",
     "CREATE TABLE images(id INTEGER PRIMARY KEY, session INTEGER NOT NULL, stamp_ns INTEGER NOT NULL, "
     "east_m REAL NOT NULL, north_m REAL NOT NULL, yaw_rad REAL NOT NULL, feature_count INTEGER NOT NULL)"},
    {"landmarks",
     "CREATE TABLE landmarks(image INTEGER PRIMARY KEY, pose BLOB NOT NULL, points BLOB NOT NULL, "
     "crc32 INTEGER NOT NULL)",
     kSinceLandmarks},
    {"masks", "CREATE TABLE masks(session INTEGER PRIMARY KEY, bits BLOB NOT NULL)", kSinceCameras},
    {"meta", "CREATE TABLE meta(key TEXT PRIMARY KEY, value NOT NULL) WITHOUT ROWID"},
    {"previews", "CREATE TABLE previews(image INTEGER PRIMARY KEY, jpeg BLOB NOT NULL, crc32 INTEGER NOT NULL)"},
}};

/// Removes `key` from `meta` and returns its value.
template <class T>
T take(ParameterValues& meta, const std::string& key) {
  const auto found = meta.find(key);
  if (found == meta.end()) throw std::runtime_error("meta value '" + key + "' is missing");
  const T* value = std::get_if<T>(&found->second);
  if (value == nullptr) throw std::runtime_error("meta value '" + key + "' is of the wrong type");
  T taken = *value;
  meta.erase(found);
  return taken;
}

int takeSide(ParameterValues& meta, const std::string& key) {
  const auto side = take<std::int64_t>(meta, key);
  if (side < kSmallestImageSide_px || side > kMaxImageSide_px) {
    throw std::runtime_error("meta value '" + key + "' = " + std::to_string(side) + " is not in [" +
                             std::to_string(kSmallestImageSide_px) + ", " + std::to_string(kMaxImageSide_px) + "]");
  }
  return static_cast<int>(side);
}

SiftConfig takeSift(ParameterValues& meta) {
  SiftConfig sift;
  ParameterValues values = parameters::values([&sift](ParameterVisitor& visitor) { sift.declare(visitor); });
  for (auto& [name, value] : values) {
    const auto found = meta.find(name);
    if (found == meta.end()) throw std::runtime_error("meta value '" + name + "' is missing");
    value = found->second;
    meta.erase(found);
  }
  assignParameters(sift, values);
  return sift;
}

std::string sessionKey(std::size_t session) { return "session/" + std::to_string(session); }

/// Removes all values whose keys begin with `prefix` and returns them without it.
ParameterValues takeGroup(ParameterValues& meta, const std::string& prefix) {
  ParameterValues group;
  auto value = meta.lower_bound(prefix);
  while (value != meta.end() && value->first.compare(0, prefix.size(), prefix) == 0) {
    group.emplace(value->first.substr(prefix.size()), value->second);
    value = meta.erase(value);
  }
  return group;
}

std::optional<CameraModel> takeCamera(ParameterValues& meta, const std::string& session) {
  const ParameterValues values = takeGroup(meta, session + kCamera);
  if (values.empty()) return std::nullopt;
  try {
    return cameraOf(values);
  } catch (const CameraError& error) {
    throw std::runtime_error("the camera of " + session + ": " + error.what());
  }
}

ParameterValues toValues(const SensorMount& mount) {
  const Eigen::Vector3d& camera_m = mount.camera.position_m;
  const Eigen::Quaterniond& rotation = mount.camera.rotation;
  return {{"camera_x_m", camera_m.x()},         {"camera_y_m", camera_m.y()},
          {"camera_z_m", camera_m.z()},         {"camera_qw", rotation.w()},
          {"camera_qx", rotation.x()},          {"camera_qy", rotation.y()},
          {"camera_qz", rotation.z()},          {"antenna_x_m", mount.antenna_m.x()},
          {"antenna_y_m", mount.antenna_m.y()}, {"antenna_z_m", mount.antenna_m.z()}};
}

std::optional<SensorMount> takeMount(ParameterValues& meta, const std::string& session) {
  ParameterValues values = takeGroup(meta, session + kMount);
  if (values.empty()) return std::nullopt;
  const auto number = [&values](const char* name) { return take<double>(values, name); };
  SensorMount mount;
  mount.camera.position_m = {number("camera_x_m"), number("camera_y_m"), number("camera_z_m")};
  const double w = number("camera_qw");
  const double x = number("camera_qx");
  const double y = number("camera_qy");
  mount.camera.rotation = Eigen::Quaterniond(w, x, y, number("camera_qz"));
  mount.antenna_m = {number("antenna_x_m"), number("antenna_y_m"), number("antenna_z_m")};
  try {
    requireMount(mount);
  } catch (const MountError& error) {
    throw std::runtime_error("the mount of " + session + ": " + error.what());
  }
  if (!values.empty())
    throw std::runtime_error("meta value '" + session + kMount + values.begin()->first + "' is unknown");
  mount.camera.rotation.normalize();
  return mount;
}

Mask takeMask(ParameterValues& meta, std::size_t session, const cv::Size& size, const MaskBits& masks) {
  const std::string key = sessionKey(session);
  const auto bits = masks.find(static_cast<std::int64_t>(session));
  if ((meta.count(key + kMask) == 0) != (bits == masks.end())) {
    throw std::runtime_error("the mask of " + key + " is missing or unexpected");
  }
  if (bits == masks.end()) return {};
  const sqlite::Bytes bytes{bits->second.data(), bits->second.size()};
  if (take<std::int64_t>(meta, key + kMask) != crc32Of(bytes)) {
    throw std::runtime_error("the mask of " + key + " does not agree with its checksum");
  }
  return unpackMask(bytes, size);
}

std::vector<Session> takeSessions(ParameterValues& meta, int version, const cv::Size& size, const MaskBits& masks) {
  std::vector<Session> sessions;
  std::size_t used = 0;
  while (meta.count(sessionKey(sessions.size())) != 0) {
    const std::string key = sessionKey(sessions.size());
    Session session{take<std::string>(meta, key)};
    if (version >= kSinceCameras) {
      session.camera = takeCamera(meta, key);
      session.mount = takeMount(meta, key);
      session.mask = takeMask(meta, sessions.size(), size, masks);
    }
    if (!session.mask.empty()) ++used;
    sessions.push_back(std::move(session));
  }
  if (used != masks.size()) throw std::runtime_error("there is a mask without a session");
  return sessions;
}

std::uint64_t bitsOf(double value) {
  // SQLite does not keep the sign of zero.
  const double normal = value == 0.0 ? 0.0 : value;
  std::uint64_t bits = 0;
  std::memcpy(&bits, &normal, sizeof(bits));
  return bits;
}

}  // namespace

std::vector<Table> tablesOf(int version) {
  std::vector<Table> tables;
  std::copy_if(kTables.begin(), kTables.end(), std::back_inserter(tables),
               [version](const Table& table) { return table.since <= version; });
  return tables;
}

std::int64_t crc32Of(sqlite::Bytes bytes, std::int64_t previous) {
  // SQLite's own limit of 2 GiB a value keeps every size within zlib's 32 bits.
  if (bytes.size == 0) return previous;
  return static_cast<std::int64_t>(::crc32(static_cast<uLong>(previous), bytes.data, static_cast<uInt>(bytes.size)));
}

std::int64_t rowChecksum(std::int64_t image, std::initializer_list<sqlite::Bytes> blobs) {
  std::array<std::uint8_t, 8> number{};
  putLittleEndian(static_cast<std::uint64_t>(image), number.data());
  std::int64_t checksum = crc32Of({number.data(), number.size()});
  for (const sqlite::Bytes& blob : blobs) checksum = crc32Of(blob, checksum);
  return checksum;
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

ParameterValues toMeta(const MapHeader& header, std::size_t geometry_count) {
  SiftConfig sift = header.sift;
  ParameterValues meta = parameters::values([&sift](ParameterVisitor& visitor) { sift.declare(visitor); });
  meta["datum/latitude_deg"] = header.datum.latitude_deg;
  meta["datum/longitude_deg"] = header.datum.longitude_deg;
  meta["datum/altitude_m"] = header.datum.altitude_m;
  meta["image/width_px"] = std::int64_t{header.image_size.width};
  meta["image/height_px"] = std::int64_t{header.image_size.height};
  meta["package_version"] = std::string(VISUAL_LOCALIZATION_VERSION);
  meta[kGeometryCount] = static_cast<std::int64_t>(geometry_count);
  for (std::size_t i = 0; i < header.sessions.size(); ++i) {
    const Session& session = header.sessions[i];
    const std::string key = sessionKey(i);
    meta[key] = session.name;
    if (session.camera) {
      for (const auto& [name, value] : toValues(*session.camera)) meta[key + kCamera + name] = value;
    }
    if (session.mount) {
      for (const auto& [name, value] : toValues(*session.mount)) meta[key + kMount + name] = value;
    }
    if (session.mask.empty()) continue;
    const std::vector<std::uint8_t> bits = packMask(session.mask);
    meta[key + kMask] = crc32Of({bits.data(), bits.size()});
  }
  return meta;
}

std::size_t takeGeometryCount(ParameterValues& meta, int version) {
  if (version < kSinceLandmarks) return 0;
  const auto count = take<std::int64_t>(meta, kGeometryCount);
  if (count >= 0 && count <= kMaxImages) return static_cast<std::size_t>(count);
  throw std::runtime_error("meta value '" + std::string(kGeometryCount) + "' = " + std::to_string(count) +
                           " is not in [0, " + std::to_string(kMaxImages) + "]");
}

MapHeader toHeader(ParameterValues meta, int version, const MaskBits& masks) {
  MapHeader header;
  header.datum.latitude_deg = take<double>(meta, "datum/latitude_deg");
  header.datum.longitude_deg = take<double>(meta, "datum/longitude_deg");
  header.datum.altitude_m = take<double>(meta, "datum/altitude_m");
  header.image_size = {takeSide(meta, "image/width_px"), takeSide(meta, "image/height_px")};
  take<std::string>(meta, "package_version");
  header.sift = takeSift(meta);
  header.sessions = takeSessions(meta, version, header.image_size, masks);
  if (!meta.empty()) throw std::runtime_error("meta value '" + meta.begin()->first + "' is unknown");
  return header;
}

std::vector<std::uint8_t> packMask(const Mask& mask) {
  std::vector<std::uint8_t> bytes((mask.grey().total() + 7) / 8);
  std::size_t pixel = 0;
  for (int row = 0; row < mask.grey().rows; ++row) {
    for (int column = 0; column < mask.grey().cols; ++column, ++pixel) {
      const unsigned bit = mask.grey().at<std::uint8_t>(row, column) != 0 ? 0x80U : 0U;
      bytes[pixel / 8] = static_cast<std::uint8_t>(bytes[pixel / 8] | bit >> (pixel % 8));
    }
  }
  return bytes;
}

Mask unpackMask(sqlite::Bytes bytes, const cv::Size& size) {
  const auto pixels = static_cast<std::size_t>(size.area());
  if (bytes.size != (pixels + 7) / 8) {
    throw std::runtime_error("a mask has " + std::to_string(bytes.size) + " bytes instead of " +
                             std::to_string((pixels + 7) / 8));
  }
  cv::Mat grey(size, CV_8U);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    grey.data[pixel] = (bytes.data[pixel / 8] << (pixel % 8) & 0x80) != 0 ? 255 : 0;
  }
  return Mask(grey);
}

std::vector<std::uint8_t> packKeypoints(const std::vector<SiftKeypoint>& keypoints) {
  std::vector<std::uint8_t> bytes(keypoints.size() * kKeypointBytes);
  std::uint8_t* to = bytes.data();
  for (const SiftKeypoint& keypoint : keypoints) {
    for (const float value : {keypoint.x_px, keypoint.y_px, keypoint.size_px, keypoint.angle_deg}) {
      putFloat(value, to);
      to += sizeof(float);
    }
  }
  return bytes;
}

std::vector<SiftKeypoint> unpackKeypoints(sqlite::Bytes bytes) {
  std::vector<SiftKeypoint> keypoints(bytes.size / kKeypointBytes);
  const std::uint8_t* from = bytes.data;
  for (SiftKeypoint& keypoint : keypoints) {
    keypoint = {getFloat(from), getFloat(from + 4), getFloat(from + 8), getFloat(from + 12)};
    for (const float value : {keypoint.x_px, keypoint.y_px, keypoint.size_px, keypoint.angle_deg}) {
      if (!std::isfinite(value)) throw std::runtime_error("a keypoint is not finite");
    }
    from += kKeypointBytes;
  }
  return keypoints;
}

std::vector<std::uint8_t> packHistogram(const GlobalFeatures::Histogram& histogram) {
  std::vector<std::uint8_t> bytes(kHistogramBytes);
  for (std::size_t i = 0; i < histogram.size(); ++i) putFloat(histogram[i], &bytes[i * sizeof(float)]);
  return bytes;
}

GlobalFeatures::Histogram unpackHistogram(sqlite::Bytes bytes) {
  if (bytes.size != kHistogramBytes) throw std::runtime_error("a global descriptor has a wrong size");
  GlobalFeatures::Histogram histogram{};
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    histogram[i] = getFloat(bytes.data + i * sizeof(float));
    if (!(std::isfinite(histogram[i]) && histogram[i] >= 0.0F)) {
      throw std::runtime_error("a global descriptor is not finite or negative");
    }
  }
  return histogram;
}

}  // namespace visual_localization::map_schema
