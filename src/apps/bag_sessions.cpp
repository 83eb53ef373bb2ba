#include "apps/bag_sessions.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <iomanip>
#include <iostream>
#include <set>
#include <unordered_set>
#include <utility>

#include <pwd.h>
#include <unistd.h>

#include "apps/app_support.h"
#include "apps/config_values.h"
#include "apps/session_clock.h"
#include "bag/recorded_mount.h"
#include "base/files.h"
#include "base/text.h"
#include "editing/map_selection.h"
#include "map/map_geometry.h"
#include "map/map_writer.h"
#include "ros/message_readers.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization::apps {
namespace {

/// Bags of the same name in different folders get different session names.
std::string sessionName(const std::string& bag, const std::vector<PlottedSession>& sessions) {
  std::set<std::string> used;
  for (const PlottedSession& session : sessions) used.insert(session.name);
  return unusedName(oneLine(std::filesystem::path(bag).stem().string()), used);
}

/// One line the first time, then counted.
cv::Mat decode(const BagImage& image, const std::string& where, bool& warned) {
  try {
    return image.decode();
  } catch (const ImageError& error) {
    if (!warned) warn(where + ": unusable image: " + error.what());
    warned = true;
    return {};
  }
}

/// Which images are, by their place in the recording and their time.
using Wanted = std::function<bool(std::size_t, std::int64_t)>;

void addImages(MapBuilder& builder, const BagReader& bag, const std::string& topic, const Wanted& wanted) {
  const BagImages images = bag.images(topic);
  ProgressBar bar("extracting features");
  bool warned = false;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const BagImage image = images.read(i);
    if (wanted(i, image.stamp_ns) && builder.wants(image.stamp_ns, image.size)) {
      builder.addImage(image.stamp_ns, decode(image, bag.path() + ": " + images.topic(), warned));
    }
    bar.show(i + 1, images.size());
  }
}

/// The one that the parameter names, or the one with the most usable fixes. What is worth a line goes to `remarks`.
Receiver receiverOf(const BagReader& bag, const MapBuilderOptions& options, const MapBuilderConfig& config,
                    std::vector<Remark>& remarks) {
  std::vector<Receiver> receivers = bag.receivers(options.fix_topic);
  if (receivers.empty()) return {};
  auto chosen = receivers.begin();
  std::vector<std::string> names;
  for (const Receiver& one : receivers) names.push_back("'" + oneLine(one.frame) + "'");
  if (!config.fix_frame.empty()) {
    chosen = std::find_if(receivers.begin(), receivers.end(),
                          [&](const Receiver& one) { return one.frame == withoutSlash(config.fix_frame); });
    if (chosen == receivers.end()) {
      throw BagError(bag.path() + ": " + options.fix_topic + ": robot/fix_frame '" + config.fix_frame +
                     "' is none of the frames of its fixes: " + joined(names));
    }
  }
  if (receivers.size() > 1) {
    remarks.push_back({"fixes of " + std::to_string(receivers.size()) + " receivers on one topic, frames " +
                       joined(names) + ": those of '" + oneLine(chosen->frame) +
                       "' count (robot/fix_frame chooses another)"});
  }
  if (!chosen->said.empty()) remarks.push_back({chosen->said});
  return std::move(*chosen);
}

[[noreturn]] void refuseHalf(const BagReader& bag, const char* given, const char* missing) {
  throw BagError(bag.path() + ": " + given + " is given without " + missing +
                 ", and no frames in the bag tell it: half a mounting would bend every turn; give both");
}

/// Of the parameters, or of the frames in the bag. How it was found goes to `remarks`.
std::optional<SensorMount> mountOf(const BagReader& bag, const MapBuilderOptions& options,
                                   const MapBuilderConfig& config, const std::string& antenna_frame,
                                   std::vector<Remark>& remarks) {
  const bool has_camera = !config.camera_mount.empty();
  const bool has_antenna = !config.antenna_mount.empty();
  SensorMount given;
  if (has_camera) given.camera = parseCameraMount(config.camera_mount);
  if (has_antenna) given.antenna_m = parseAntennaMount(config.antenna_mount);
  if (has_camera && has_antenna) return given;
  if (has_camera) {
    const auto antenna = bag.transforms(true)->pose(config.base_frame, antenna_frame);
    if (!antenna) refuseHalf(bag, "robot/camera", "robot/antenna");
    given.antenna_m = antenna->translation();
    return given;
  }
  const auto antenna = has_antenna ? std::nullopt : std::optional<std::string>(antenna_frame);
  std::optional<RobotMount> found = recordedMount(bag, {config.base_frame, options.image_topic, antenna}, options.bags);
  if (!found && has_antenna) refuseHalf(bag, "robot/antenna", "robot/camera");
  if (!found) return std::nullopt;
  if (has_antenna) found->mount.antenna_m = given.antenna_m;
  remarks.push_back({found->said});
  return found->mount;
}

/// Of the option, or of the bag.
SessionCamera cameraOf(const BagReader& bag, const MapBuilderOptions& options,
                       const std::optional<SensorMount>& mount) {
  SessionCamera camera;
  camera.mount = mount;
  camera.model = options.camera_info.empty() ? bag.camera(options.image_topic) : readCameraFile(options.camera_info);
  if (!options.mask.empty()) camera.mask = readMask(options.mask);
  camera.image_size = bag.images(options.image_topic).usualSize();
  return camera;
}

void addTo(MapBuilder& builder, const BagReader& bag, const MapBuilderOptions& options, PlottedSession session,
           const SessionCamera& camera, std::vector<PlottedSession>& sessions, const Wanted& wanted) {
  try {
    builder.beginSession(session.name, session.fixes, camera);
  } catch (const std::exception& error) {
    throw BagError(bag.path() + ": " + options.fix_topic + ": " + error.what());
  }
  session.cleaned = builder.report().sessions.back();
  sessions.push_back(std::move(session));
  addImages(builder, bag, options.image_topic, wanted);
}

}  // namespace

namespace {

struct GivenParameter {
  const char* option;
  const char* name;
  ParameterValue value;
};

/// What the options set. Throws UsageError, naming the option, for what is out of range or contradicts a preset, even
/// where it is a default.
ParameterValues valuesOf(const MapBuilderOptions& options) {
  std::vector<GivenParameter> all;
  if (options.min_spacing_m) all.push_back({"--min-spacing", "map/min_spacing", *options.min_spacing_m});
  if (options.spacing_m) {
    all.push_back({"--spacing", "map/spacing", *options.spacing_m});
    all.push_back({"--spacing", "geometry/spacing", *options.spacing_m});
  }
  if (options.self_calibrate) all.push_back({"--self-calibrate", "geometry/self_calibration", true});
  if (!options.model.empty()) {
    all.push_back({"--model", "map/features", std::string("learned")});
    all.push_back({"--model", "map/model", options.model});
  }
  ParameterValues given;
  if (!options.preset.empty()) given["preset"] = options.preset;
  mapBuilderValues(given);
  for (const GivenParameter& one : all) {
    try {
      MapBuilderConfig alone;
      assignParameters(alone, {{one.name, one.value}});
      given[one.name] = one.value;
      mapBuilderValues(given);
    } catch (const ParameterError& error) {
      throw UsageError(std::string(one.option) + ": " + error.what());
    }
  }
  return given;
}

}  // namespace

MapBuilderConfig readConfig(const MapBuilderOptions& options) {
  return joinedConfig<MapBuilderConfig>(
      options.config, options.preset, [&options] { return valuesOf(options); }, mapBuilderValues);
}

void requireDifferent(const std::string& what, const std::vector<std::string>& files) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    for (std::size_t earlier = 0; earlier < i; ++earlier) {
      std::error_code none;
      if (std::filesystem::equivalent(files[i], files[earlier], none)) {
        throw UsageError(what + " " + files[i] + " is the same file as " + what + " " + files[earlier]);
      }
    }
  }
}

void addSession(MapBuilder& builder, const std::string& path, const MapBuilderOptions& options,
                const MapBuilderConfig& config, std::vector<PlottedSession>& sessions) {
  const BagReader bag(path);
  PlottedSession session{sessionName(path, sessions), {}, {}};
  Receiver receiver = receiverOf(bag, options, config, session.remarks);
  SessionCamera camera = cameraOf(bag, options, mountOf(bag, options, config, receiver.frame, session.remarks));
  for (const Remark& pause : breaksOf(receiver.fixes, config.trajectory)) session.remarks.push_back(pause);
  const BagImages images = bag.images(options.image_topic);
  const ImageOrder order = orderOf(bag, images);
  if (order.remark) session.remarks.push_back(*order.remark);
  const ClockCheck clock = checkClock(bag, images, order, receiver.fixes, config, camera.mount, options.threads);
  session.remarks.push_back(clock.remark);
  session.fixes = putRight(std::move(receiver.fixes), clock);
  camera.clock_sigma_s = std::max(camera.clock_sigma_s, clock.sigma_s);
  addTo(builder, bag, options, std::move(session), camera, sessions,
        [&order](std::size_t i, std::int64_t) { return order.used[i]; });
}

void addVerifiedSession(MapBuilder& builder, const std::string& path, const VerifiedDrive& drive,
                        const MapBuilderOptions& options, std::vector<PlottedSession>& sessions) {
  const BagReader bag(path);
  std::set<std::int64_t> verified;
  for (const Fix& pose : drive.poses) verified.insert(pose.stamp_ns);
  SessionCamera camera = drive.camera;
  camera.image_size = bag.images(options.image_topic).usualSize();
  addTo(builder, bag, options, {sessionName(path, sessions), drive.poses, {}}, camera, sessions,
        [&](std::size_t, std::int64_t stamp_ns) { return verified.count(stamp_ns) != 0; });
}

namespace {

constexpr std::size_t kCache_bytes = std::size_t{512} << 20U;  ///< of all maps together

std::string user() {
  const passwd* entry = ::getpwuid(::geteuid());
  return entry == nullptr ? std::to_string(::geteuid()) : entry->pw_name;
}

std::string host() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "?";
}

void printMerged(const MergedMap& map) {
  std::cout << oneLine(map.name) << ": " << map.images << " images, " << map.with_landmarks << " with landmarks; ";
  if (map.tied > 0) {
    std::cout << map.tied << " tied to the maps before: median offset " << std::fixed << std::setprecision(2)
              << map.apart_m << " m before, " << map.left_m << " m after\n";
  } else if (map.with_landmarks == 0) {
    std::cout << "without landmarks it lies where its fixes have it\n";
  } else {
    std::cout << "overlaps with no map before: it lies where its fixes have it\n";
  }
}

void printAllMerged(const std::vector<MergedMap>& merged) {
  std::cout << oneLine(merged.front().name) << ": " << merged.front().images << " images, the reference\n";
  for (std::size_t k = 1; k < merged.size(); ++k) printMerged(merged[k]);
}

/// `target`: see mergeMaps.
template <class Target>
void mergeAndPrint(const Target& target, const std::vector<NamedMap>& maps, const std::string& edit,
                   std::size_t threads) {
  std::vector<MergedMap> merged;
  {
    ProgressBar bar("aligning");
    merged =
        mergeMaps(maps, edit, target, threads, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
  }
  printAllMerged(merged);
}

MapBuilder builderFor(const TrainingMap& map, const MapBuilderOptions& options, MapBuilderConfig& config,
                      const std::string& output) {
  config.local.choose(*map.header().kind);
  return MapBuilder(config, {options.threads, output}, MapBase{map.header().datum, map.header().image_size});
}

void saveSessions(MapBuilder& builder, const MapBuilderOptions& options, const MapBuilderConfig& config,
                  const std::vector<PlottedSession>& sessions, const PartialFile& file) {
  {
    ProgressBar bar("pruning features");
    builder.save(file, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
  }
  printReport(options, builder.report(), config.geometry, sessions);
}

/// Merges `file` beside `map`; see addDrive for `usage`.
void mergeAndCull(const NamedMap& map, const std::string& name, const PartialFile& file, const MapUsage& usage,
                  const std::string& output, const std::string& edit, std::size_t threads) {
  const PartialFile merged(output);
  mergeAndPrint(merged, {map, {name, openMap(file.path(), 2)}}, edit, threads);
  const auto grown = openMap(merged.path());
  SummaryConfig where_driven;
  where_driven.unused_places = false;
  const std::vector<bool> keep = summary(*grown, usage, where_driven);
  std::cout << "left out where the drive was: " << std::count(keep.begin(), keep.end(), false) << " images\n";
  writeSelection(*grown, keep, "", output);
}

}  // namespace

std::string provenance(const std::string& program, const std::string& command, const std::vector<std::string>& from) {
  constexpr std::size_t kLongest = 4000;  // a job of a thousand maps names the first hundred
  std::vector<std::string> names;
  for (const std::string& path : from) names.push_back(std::filesystem::path(path).filename().string());
  return oneLine(command + " of " + joined(names), kLongest) + " by " + program + " " + VISUAL_LOCALIZATION_VERSION +
         ", " + oneLine(user() + "@" + host());
}

std::shared_ptr<const TrainingMap> openMap(const std::string& path, std::size_t of) {
  return loadMap(path, strictLoading(kCache_bytes / of));
}

void mergeInto(const std::string& path, const std::vector<NamedMap>& maps, const std::string& edit,
               std::size_t threads) {
  mergeAndPrint(path, maps, edit, threads);
}

void requireNewRecording(const std::string& path, const std::string& image_topic, const NamedMap& map) {
  const BagReader bag(path);
  const BagImages images = bag.images(image_topic);
  if (images.size() == 0) return;
  // Most recordings are of another time: then two images tell.
  const std::int64_t first_ns = images.read(0).stamp_ns;
  const std::int64_t last_ns = images.read(images.size() - 1).stamp_ns;
  const auto is_between = [=](std::int64_t stamp_ns) { return first_ns <= stamp_ns && stamp_ns <= last_ns; };
  if (!knownSession(*map.map, is_between)) return;
  std::unordered_set<std::int64_t> stamps_ns;
  for (std::size_t i = 0; i < images.size(); ++i) stamps_ns.insert(images.read(i).stamp_ns);
  const auto session = knownSession(*map.map, [&](std::int64_t stamp_ns) { return stamps_ns.count(stamp_ns) != 0; });
  if (!session) return;
  throw BagError(path + ": is in " + map.name + " already, as session '" + map.map->header().sessions[*session].name +
                 "' (the same times): remove that first");
}

void addSessions(const NamedMap& map, const MapBuilderOptions& options, const MapUsage* usage,
                 const std::string& output, const std::string& edit) {
  for (const std::string& bag : options.bags) requireNewRecording(bag, options.image_topic, map);
  MapBuilderConfig config = readConfig(options);
  MapBuilder builder = builderFor(*map.map, options, config, output);
  std::vector<PlottedSession> sessions;
  for (const std::string& bag : options.bags) addSession(builder, bag, options, config, sessions);
  const PartialFile added(output);
  saveSessions(builder, options, config, sessions, added);
  const std::string name = joined(options.bags);
  if (usage != nullptr) {
    mergeAndCull(map, name, added, *usage, output, edit, options.threads);
  } else {
    mergeAndPrint(output, {map, {name, openMap(added.path(), 2)}}, edit, options.threads);
  }
  printDisagreements(builder.report(), sessions);
}

void addDrive(const NamedMap& map, const VerifiedDrive& drive, const MapBuilderOptions& options, const MapUsage& usage,
              const std::string& output, const std::string& edit) {
  MapBuilderConfig config = readConfig(options);
  MapBuilder builder = builderFor(*map.map, options, config, output);
  std::vector<PlottedSession> sessions;
  addVerifiedSession(builder, options.bags.front(), drive, options, sessions);
  const PartialFile added(output);
  saveSessions(builder, options, config, sessions, added);
  mergeAndCull(map, options.bags.front(), added, usage, output, edit, options.threads);
}

}  // namespace visual_localization::apps
