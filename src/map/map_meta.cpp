#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "features/image_size.h"
#include "map/map_schema.h"
#include "visual_localization/parameters/presets.h"

namespace visual_localization::map_schema {
namespace {

constexpr const char* kCamera = "/camera/";  ///< behind the key of the session
constexpr const char* kPublished = "/published_camera/";
constexpr const char* kMount = "/mount/";        ///< likewise
constexpr const char* kFixes = "/fixes/";        ///< likewise
constexpr const char* kDoubtful = "/doubtful/";  ///< likewise, before the number of the stretch
constexpr const char* kMask = "/mask";
constexpr const char* kKind = "features/kind";
constexpr const char* kDimension = "features/dimension";  ///< of a descriptor
constexpr double kLargestBudget = 1e9;                    ///< metres or seconds
constexpr const char* kGeometryCount = "geometry/images";
constexpr const char* kVocabulary = "vocabulary";
constexpr const char* kPreset = "preset";     ///< only of a map that was built with one
constexpr const char* kHistory = "history/";  ///< before the number of the edit

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

cv::Size takeImageSize(ParameterValues& meta) {
  const cv::Size size(takeSide(meta, "image/width_px"), takeSide(meta, "image/height_px"));
  // Live images are resized to it: it decides how much memory and time each one takes.
  if (const auto reason = whyTooLarge(size)) throw std::runtime_error("its images are too large: " + *reason);
  return size;
}

bool takeFlag(ParameterValues& meta, const std::string& key) {
  const auto flag = take<std::int64_t>(meta, key);
  if (flag == 0 || flag == 1) return flag == 1;
  throw std::runtime_error("meta value '" + key + "' = " + std::to_string(flag) + " is not 0 or 1");
}

/// The kind of local features and its parameters.
std::shared_ptr<const LocalFeatureKind> takeKind(ParameterValues& meta) {
  std::unique_ptr<LocalFeatureKind> kind = makeLocalFeatureKind(take<std::string>(meta, kKind));
  ParameterValues values = kind->parameters();
  for (auto& [name, value] : values) {
    if (std::holds_alternative<bool>(value)) {
      value = takeFlag(meta, name);
      continue;
    }
    const auto found = meta.find(name);
    if (found == meta.end()) throw std::runtime_error("meta value '" + name + "' is missing");
    value = found->second;
    meta.erase(found);
  }
  parameters::assign([&kind](ParameterVisitor& visitor) { kind->declareStored(visitor); }, values);
  const auto wrong = parameters::violations([&kind](ParameterVisitor& visitor) { kind->declareStored(visitor); });
  if (!wrong.empty()) throw ParameterError(wrong.front());
  const auto dimension = static_cast<std::int64_t>(kind->form().dimension);
  if (take<std::int64_t>(meta, kDimension) == dimension) return kind;
  throw std::runtime_error("its features '" + kind->name() + "' are not of dimension " + std::to_string(dimension));
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

std::optional<CameraModel> takeCamera(ParameterValues& meta, const std::string& session, const char* group) {
  const ParameterValues values = takeGroup(meta, session + group);
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

ParameterValues toValues(const FixBudget& fixes) {
  return {{"declared_m", fixes.declared_m}, {"assumed", std::int64_t{fixes.assumed}},
          {"residual_m", fixes.residual_m}, {"correlation_s", fixes.correlation_s},
          {"duration_s", fixes.duration_s}, {"sigma_m", fixes.sigma_m}};
}

double requireInBudget(double value, const std::string& key) {
  if (value >= 0.0 && value <= kLargestBudget) return value;
  throw std::runtime_error("meta value '" + key + "' = " + std::to_string(value) + " is not in [0, " +
                           std::to_string(kLargestBudget) + "]");
}

std::optional<FixBudget> takeFixes(ParameterValues& meta, const std::string& session) {
  ParameterValues values = takeGroup(meta, session + kFixes);
  if (values.empty()) return std::nullopt;
  FixBudget fixes;
  for (const auto& [name, to] : {std::pair<const char*, double*>{"declared_m", &fixes.declared_m},
                                 {"residual_m", &fixes.residual_m},
                                 {"correlation_s", &fixes.correlation_s},
                                 {"duration_s", &fixes.duration_s},
                                 {"sigma_m", &fixes.sigma_m}}) {
    *to = requireInBudget(take<double>(values, name), session + kFixes + name);
  }
  fixes.assumed = takeFlag(values, "assumed");
  if (values.empty()) return fixes;
  throw std::runtime_error("meta value '" + session + kFixes + values.begin()->first + "' is unknown");
}

ParameterValues toValues(const DoubtfulStretch& stretch) {
  return {{"from_ns", stretch.from_ns},        {"to_ns", stretch.to_ns},
          {"from_m", stretch.from_m},          {"to_m", stretch.to_m},
          {"sigma_m", stretch.sigma_m},        {"off_fixes_m", stretch.off_fixes_m},
          {"off_turns_m", stretch.off_turns_m}};
}

/// `group`: the key of the stretch.
DoubtfulStretch stretchOf(ParameterValues values, const std::string& group) {
  DoubtfulStretch stretch;
  stretch.from_ns = take<std::int64_t>(values, "from_ns");
  stretch.to_ns = take<std::int64_t>(values, "to_ns");
  for (const auto& [name, to] : {std::pair<const char*, double*>{"from_m", &stretch.from_m},
                                 {"to_m", &stretch.to_m},
                                 {"sigma_m", &stretch.sigma_m},
                                 {"off_fixes_m", &stretch.off_fixes_m},
                                 {"off_turns_m", &stretch.off_turns_m}}) {
    *to = requireInBudget(take<double>(values, name), group + name);
  }
  if (values.empty()) return stretch;
  throw std::runtime_error("meta value '" + group + values.begin()->first + "' is unknown");
}

std::vector<DoubtfulStretch> takeDoubtful(ParameterValues& meta, const std::string& session) {
  std::vector<DoubtfulStretch> doubtful;
  while (true) {
    const std::string group = session + kDoubtful + std::to_string(doubtful.size()) + '/';
    ParameterValues values = takeGroup(meta, group);
    if (values.empty()) return doubtful;
    doubtful.push_back(stretchOf(std::move(values), group));
  }
}

/// Of masks that differ, in memory; packed they are small.
void requireMasks(std::size_t count, const cv::Size& size) {
  constexpr std::size_t kMost_bytes = std::size_t{256} << 20U;
  const std::size_t most = kMost_bytes / static_cast<std::size_t>(size.area());
  if (count <= most) return;
  throw std::runtime_error("it has more than " + std::to_string(most) + " different masks of " +
                           std::to_string(size.width) + "x" + std::to_string(size.height) +
                           " pixels, which take 256 MiB");
}

/// The masks of a map. Sessions of one camera share theirs; what all take together is bounded.
class DecodedMasks {
 public:
  explicit DecodedMasks(const cv::Size& size) : size_(size) {}

  Mask of(const std::vector<std::uint8_t>& bits) {
    const auto known = masks_.find(&bits);
    if (known != masks_.end()) return known->second;
    requireMasks(masks_.size() + 1, size_);
    return masks_[&bits] = unpackMask({bits.data(), bits.size()}, size_);
  }

 private:
  struct ByContent {
    bool operator()(const std::vector<std::uint8_t>* a, const std::vector<std::uint8_t>* b) const { return *a < *b; }
  };

  cv::Size size_;
  std::map<const std::vector<std::uint8_t>*, Mask, ByContent> masks_;
};

Mask takeMask(ParameterValues& meta, std::size_t session, const MaskBits& masks, DecodedMasks& decoded) {
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
  return decoded.of(bits->second);
}

void requireName(const std::string& key, const std::string& name) {
  if (name.size() <= kMaxNameBytes) return;
  throw std::runtime_error("the name of " + key + " has " + std::to_string(name.size()) + " bytes, at most " +
                           std::to_string(kMaxNameBytes) + " are allowed");
}

void requireSessions(std::size_t count) {
  if (count <= kMaxSessions) return;
  throw std::runtime_error("it has more than the " + std::to_string(kMaxSessions) + " sessions that are allowed");
}

std::vector<Session> takeSessions(ParameterValues& meta, const cv::Size& size, const MaskBits& masks) {
  std::vector<Session> sessions;
  DecodedMasks decoded(size);
  std::size_t used = 0;
  while (meta.count(sessionKey(sessions.size())) != 0) {
    requireSessions(sessions.size() + 1);
    const std::string key = sessionKey(sessions.size());
    Session session{take<std::string>(meta, key)};
    requireName(key, session.name);
    session.camera = takeCamera(meta, key, kCamera);
    session.mount = takeMount(meta, key);
    session.mask = takeMask(meta, sessions.size(), masks, decoded);
    session.published = takeCamera(meta, key, kPublished);
    session.fixes = takeFixes(meta, key);
    session.doubtful = takeDoubtful(meta, key);
    if (!session.mask.empty()) ++used;
    sessions.push_back(std::move(session));
  }
  if (used != masks.size()) throw std::runtime_error("there is a mask without a session");
  return sessions;
}

std::shared_ptr<const VladVocabulary> takeVocabulary(ParameterValues& meta, const MapHeader& header,
                                                     const std::vector<std::uint8_t>& stored) {
  if ((meta.count(kVocabulary) == 0) != stored.empty()) {
    throw std::runtime_error("the vocabulary is missing or unexpected");
  }
  if (stored.empty()) return nullptr;
  const sqlite::Bytes bytes{stored.data(), stored.size()};
  if (take<std::int64_t>(meta, kVocabulary) != crc32Of(bytes)) {
    throw std::runtime_error("the vocabulary does not agree with its checksum");
  }
  return unpackVocabulary(bytes, header.kind->form().dimension, header.image_size);
}

std::vector<std::string> takeHistory(ParameterValues& meta) {
  std::vector<std::string> history;
  for (std::string key = kHistory + std::string("0"); meta.count(key) != 0;
       key = kHistory + std::to_string(history.size())) {
    history.push_back(take<std::string>(meta, key));
  }
  return history;
}

}  // namespace

namespace {

void addCamera(const std::optional<CameraModel>& camera, const std::string& group, ParameterValues& meta) {
  if (!camera) return;
  for (const auto& [name, value] : toValues(*camera)) meta[group + name] = value;
}

}  // namespace

ParameterValues toMeta(const MapHeader& header, std::size_t geometry_count) {
  ParameterValues meta = header.kind->parameters();
  for (auto& [name, value] : meta) {
    if (const bool* flag = std::get_if<bool>(&value)) value = std::int64_t{*flag};
  }
  meta[kKind] = header.kind->name();
  meta[kDimension] = static_cast<std::int64_t>(header.kind->form().dimension);
  meta["datum/latitude_deg"] = header.datum.latitude_deg;
  meta["datum/longitude_deg"] = header.datum.longitude_deg;
  meta["datum/altitude_m"] = header.datum.altitude_m;
  meta["image/width_px"] = std::int64_t{header.image_size.width};
  meta["image/height_px"] = std::int64_t{header.image_size.height};
  meta["package_version"] = std::string(VISUAL_LOCALIZATION_VERSION);
  meta[kGeometryCount] = static_cast<std::int64_t>(geometry_count);
  if (header.vocabulary) {
    const std::vector<std::uint8_t> learnt = packVocabulary(*header.vocabulary);
    meta[kVocabulary] = crc32Of({learnt.data(), learnt.size()});
  }
  if (!header.preset.empty()) meta[kPreset] = header.preset;
  for (std::size_t i = 0; i < header.history.size(); ++i) meta[kHistory + std::to_string(i)] = header.history[i];
  requireSessions(header.sessions.size());
  std::set<std::vector<std::uint8_t>> masks;
  for (std::size_t i = 0; i < header.sessions.size(); ++i) {
    const Session& session = header.sessions[i];
    const std::string key = sessionKey(i);
    requireName(key, session.name);
    meta[key] = session.name;
    addCamera(session.camera, key + kCamera, meta);
    addCamera(session.published, key + kPublished, meta);
    if (session.mount) {
      for (const auto& [name, value] : toValues(*session.mount)) meta[key + kMount + name] = value;
    }
    if (session.fixes) {
      for (const auto& [name, value] : toValues(*session.fixes)) meta[key + kFixes + name] = value;
    }
    for (std::size_t n = 0; n < session.doubtful.size(); ++n) {
      const std::string group = key + kDoubtful + std::to_string(n) + '/';
      for (const auto& [name, value] : toValues(session.doubtful[n])) meta[group + name] = value;
    }
    if (session.mask.empty()) continue;
    const std::vector<std::uint8_t>& bits = *masks.insert(packMask(session.mask)).first;
    requireMasks(masks.size(), header.image_size);
    meta[key + kMask] = crc32Of({bits.data(), bits.size()});
  }
  return meta;
}

std::size_t takeGeometryCount(ParameterValues& meta) {
  const auto count = take<std::int64_t>(meta, kGeometryCount);
  if (count >= 0 && count <= kMaxImages) return static_cast<std::size_t>(count);
  throw std::runtime_error("meta value '" + std::string(kGeometryCount) + "' = " + std::to_string(count) +
                           " is not in [0, " + std::to_string(kMaxImages) + "]");
}

MapHeader toHeader(ParameterValues meta, const MaskBits& masks, const std::vector<std::uint8_t>& vocabulary) {
  MapHeader header;
  header.datum.latitude_deg = take<double>(meta, "datum/latitude_deg");
  header.datum.longitude_deg = take<double>(meta, "datum/longitude_deg");
  header.datum.altitude_m = take<double>(meta, "datum/altitude_m");
  header.image_size = takeImageSize(meta);
  take<std::string>(meta, "package_version");
  header.kind = takeKind(meta);
  header.sessions = takeSessions(meta, header.image_size, masks);
  header.vocabulary = takeVocabulary(meta, header, vocabulary);
  if (meta.count(kPreset) != 0) header.preset = presetNamed(take<std::string>(meta, kPreset)).name;
  header.history = takeHistory(meta);
  if (!meta.empty()) throw std::runtime_error("meta value '" + meta.begin()->first + "' is unknown");
  return header;
}

}  // namespace visual_localization::map_schema
