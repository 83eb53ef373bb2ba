#include "visual_localization/map/map_builder.h"

#include <chrono>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/app_support.h"
#include "apps/build_report.h"
#include "apps/command_line.h"
#include "apps/map_plot.h"
#include "base/files.h"
#include "base/text.h"
#include "ros/camera_info.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/map/map_file.h"
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

/// Bags of the same name in different folders get different session names.
std::string sessionName(const std::string& bag, const std::vector<PlottedSession>& sessions) {
  const std::string stem = oneLine(std::filesystem::path(bag).stem().string());
  std::string name = stem;
  for (std::size_t n = 2;; ++n) {
    bool taken = false;
    for (const PlottedSession& session : sessions) taken = taken || session.name == name;
    if (!taken) return name;
    name = stem + "_" + std::to_string(n);
  }
}

/// The map would be twice as large and show nothing more, while two sessions seemed to see every position.
void requireDifferent(const std::vector<std::string>& bags) {
  for (std::size_t i = 0; i < bags.size(); ++i) {
    for (std::size_t earlier = 0; earlier < i; ++earlier) {
      std::error_code none;
      if (std::filesystem::equivalent(bags[i], bags[earlier], none)) {
        throw UsageError("--bag " + bags[i] + " is the same file as --bag " + bags[earlier]);
      }
    }
  }
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

void addImages(MapBuilder& builder, const BagReader& bag, const std::string& topic) {
  const BagImages images = bag.images(topic);
  ProgressBar bar("extracting features");
  bool warned = false;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const BagImage image = images.read(i);
    if (builder.wants(image.stamp_ns, image.size)) {
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

void addSession(MapBuilder& builder, const std::string& path, const MapBuilderOptions& options,
                const MapBuilderConfig& config, std::vector<PlottedSession>& sessions) {
  const BagReader bag(path);
  PlottedSession session{sessionName(path, sessions), bag.fixes(options.fix_topic), {}};
  const SessionCamera camera = cameraOf(bag, options, config);
  try {
    builder.beginSession(session.name, session.fixes, camera);
  } catch (const std::exception& error) {
    throw BagError(path + ": " + options.fix_topic + ": " + error.what());
  }
  session.cleaned = builder.report().sessions.back();
  sessions.push_back(std::move(session));
  addImages(builder, bag, options.image_topic);
}

/// Throws FileError when `path` cannot be created or replaced.
void requireWritable(const std::string& path) { const PartialFile attempt(path); }

/// Refuses what could only fail after the work.
void requireOutputs(const MapBuilderOptions& options) {
  std::vector<std::string> inputs = options.bags;
  inputs.insert(inputs.end(), {options.config, options.camera_info, options.mask});
  requireDifferent(options.bags);
  requireNoInput("--output", options.output, inputs);
  inputs.push_back(options.output);
  if (!options.plot.empty()) requireNoInput("--plot", options.plot, inputs);
  requireWritable(options.output);
  if (!options.plot.empty()) requireWritable(options.plot);
}

/// The map is written whatever becomes of its plot.
void draw(const MapBuilderOptions& options, std::vector<PlottedSession>& sessions, const LocalFrame& frame) {
  try {
    addMap(*loadMap(options.output), sessions);
    drawMapPlot(options.plot, sessions, frame);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(error.what() + ("; the map is written without a plot: " + options.output));
  }
}

void buildMap(const MapBuilderOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const MapBuilderConfig config = readConfig(options);
  requireOutputs(options);
  const OutputLock lock(options.output);
  MapBuilder builder(config, {options.threads, options.output});
  std::vector<PlottedSession> sessions;
  for (const std::string& bag : options.bags) addSession(builder, bag, options, config, sessions);
  if (config.geometry.enabled && config.geometry.self_calibration) announceCalibration(builder.report());
  {
    ProgressBar bar("pruning features");
    builder.save(options.output, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
  }
  printReport(options, builder.report(), config.geometry, sessions);
  printSummary(options, builder.report(),
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  if (!options.plot.empty()) draw(options, sessions, builder.frame());
}

}  // namespace
}  // namespace visual_localization::apps

int main(int argc, char** argv) {
  return visual_localization::apps::runProgram(argc, argv, visual_localization::apps::buildMap);
}
