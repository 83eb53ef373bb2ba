#include "apps/bag_sessions.h"

#include <filesystem>
#include <functional>
#include <set>
#include <utility>

#include "apps/app_support.h"
#include "base/text.h"
#include "map/sessions.h"
#include "ros/camera_info.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization::apps {
namespace {

void overrideWith(MapBuilderConfig& config, const char* option, const char* parameter, const ParameterValue& value) {
  try {
    assignParameters(config, {{parameter, value}});
  } catch (const ParameterError& error) {
    throw UsageError(std::string(option) + ": " + error.what());
  }
}

/// Bags of the same name in different folders get different session names.
std::string sessionName(const std::string& bag, const std::vector<PlottedSession>& sessions) {
  std::set<std::string> used;
  for (const PlottedSession& session : sessions) used.insert(session.name);
  return unusedName(oneLine(std::filesystem::path(bag).stem().string()), used);
}

/// An image that cannot be decoded is worth one line the first time, and is counted.
cv::Mat decode(const BagImage& image, const std::string& where, bool& warned) {
  try {
    return image.decode();
  } catch (const ImageError& error) {
    if (!warned) warn(where + ": unusable image: " + error.what());
    warned = true;
    return {};
  }
}

/// `wanted`: whether the image of this time is.
void addImages(MapBuilder& builder, const BagReader& bag, const std::string& topic,
               const std::function<bool(std::int64_t)>& wanted) {
  const BagImages images = bag.images(topic);
  ProgressBar bar("extracting features");
  bool warned = false;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const BagImage image = images.read(i);
    if (wanted(image.stamp_ns) && builder.wants(image.stamp_ns, image.size)) {
      builder.addImage(image.stamp_ns, decode(image, bag.path() + ": " + images.topic(), warned));
    }
    bar.show(i + 1, images.size());
  }
}

/// That of the parameters, or of the bag.
std::optional<SensorMount> mountOf(const BagReader& bag, const MapBuilderOptions& options,
                                   const MapBuilderConfig& config) {
  std::optional<SensorMount> mount = bag.mount(options.image_topic, options.fix_topic, config.base_frame);
  if (config.camera_mount.empty() && config.antenna_mount.empty()) return mount;
  SensorMount given = mount.value_or(SensorMount());
  if (!config.camera_mount.empty()) given.camera = parseCameraMount(config.camera_mount);
  if (!mount) given.antenna_m = given.camera.position_m;
  if (!config.antenna_mount.empty()) given.antenna_m = parseAntennaMount(config.antenna_mount);
  return given;
}

/// That of the option, or of the bag.
SessionCamera cameraOf(const BagReader& bag, const MapBuilderOptions& options, const MapBuilderConfig& config) {
  SessionCamera camera;
  camera.mount = mountOf(bag, options, config);
  camera.model = options.camera_info.empty() ? bag.camera(options.image_topic) : readCameraFile(options.camera_info);
  if (!options.mask.empty()) camera.mask = readMask(options.mask);
  camera.image_size = bag.images(options.image_topic).usualSize();
  return camera;
}

void addTo(MapBuilder& builder, const BagReader& bag, const MapBuilderOptions& options, PlottedSession session,
           const SessionCamera& camera, std::vector<PlottedSession>& sessions,
           const std::function<bool(std::int64_t)>& wanted) {
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

MapBuilderConfig readConfig(const MapBuilderOptions& options) {
  MapBuilderConfig config;
  if (!options.config.empty()) {
    const ParameterValues values = parameters::readYaml(options.config);
    try {
      assignParameters(config, values);
    } catch (const ParameterError& error) {
      throw ParameterError(options.config + ": " + error.what());
    }
  }
  if (options.min_spacing_m) overrideWith(config, "--min-spacing", "map/min_spacing", *options.min_spacing_m);
  if (options.spacing_m) {
    overrideWith(config, "--spacing", "map/spacing", *options.spacing_m);
    overrideWith(config, "--spacing", "geometry/spacing", *options.spacing_m);
  }
  if (options.self_calibrate) overrideWith(config, "--self-calibrate", "geometry/self_calibration", true);
  if (options.sift_backend) overrideWith(config, "--sift-backend", "map/sift_backend", *options.sift_backend);
  return config;
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
  PlottedSession session{sessionName(path, sessions), bag.fixes(options.fix_topic), {}};
  addTo(builder, bag, options, std::move(session), cameraOf(bag, options, config), sessions,
        [](std::int64_t) { return true; });
}

void addVerifiedSession(MapBuilder& builder, const std::string& path, const VerifiedDrive& drive,
                        const MapBuilderOptions& options, std::vector<PlottedSession>& sessions) {
  const BagReader bag(path);
  std::set<std::int64_t> verified;
  for (const Fix& pose : drive.poses) verified.insert(pose.stamp_ns);
  SessionCamera camera = drive.camera;
  camera.image_size = bag.images(options.image_topic).usualSize();
  addTo(builder, bag, options, {sessionName(path, sessions), drive.poses, {}}, camera, sessions,
        [&](std::int64_t stamp_ns) { return verified.count(stamp_ns) != 0; });
}

}  // namespace visual_localization::apps
