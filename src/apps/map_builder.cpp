#include "visual_localization/map/map_builder.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/app_support.h"
#include "apps/command_line.h"
#include "apps/map_plot.h"
#include "base/files.h"
#include "ros/camera_info.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/features/front_end.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization::apps {
namespace {

const char* const kNoCalibration = "no calibration (no camera_info, no --camera-info)";

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
  const std::string stem = std::filesystem::path(bag).stem().string();
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
    if (!warned) std::cerr << where << ": unusable image: " << error.what() << std::endl;
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
    if (builder.wants(image.stamp_ns)) {
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

void printFixes(const PlottedSession& session) {
  constexpr std::array<FixVerdict, 5> verdicts{FixVerdict::kKept, FixVerdict::kNoFix, FixVerdict::kDisordered,
                                               FixVerdict::kSpike, FixVerdict::kMultipath};
  std::cout << session.name << ": " << session.fixes.size() << " fixes:";
  for (const FixVerdict verdict : verdicts) {
    const auto count = std::count(session.cleaned.verdicts.begin(), session.cleaned.verdicts.end(), verdict);
    std::cout << (verdict == FixVerdict::kKept ? " " : ", ") << count << ' ' << toString(verdict);
  }
  std::cout << "; " << session.cleaned.gaps_closed << " gaps closed, the longest " << session.cleaned.longest_gap_s
            << " s; path " << session.cleaned.trajectory.length() << " m\n";
}

void printCamera(const SessionImages& session, const MapBuilderOptions& options, const GeometryConfig& geometry) {
  std::cout << session.name << ": ";
  if (session.calibrated_by_images) {
    std::cout << kNoCalibration << "; by its images: camera " << describe(*session.camera.model);
  } else if (session.camera.model) {
    std::cout << "camera " << describe(*session.camera.model) << ", from "
              << (options.camera_info.empty() ? cameraInfoTopic(options.image_topic) : options.camera_info);
  } else {
    std::cout << kNoCalibration << ": a map of places";
    std::cout << (geometry.self_calibration ? " (its images are not certain about one)"
                                            : "; --self-calibrate looks for one");
  }
  if (!options.mask.empty())
    std::cout << "; mask uses " << 100.0 * session.camera.mask.usedShare() << " % of the image";
  std::cout << '\n';
}

void printMount(const SessionImages& session) {
  if (!session.camera.mount) return;
  std::cout << session.name << ": " << describe(*session.camera.mount) << '\n';
}

void printGeometry(const SessionImages& session) {
  const SessionLandmarks& geometry = session.geometry;
  if (!session.camera.model) return;
  if (geometry.contradicts_calibration) {
    std::cout << session.name << ": the images contradict the calibration (they ask for "
              << 100.0 * geometry.focal_scale << " % of its focal length, move " << 100.0 * geometry.far_share
              << " % of the images by more than 3 m, and explain " << 100.0 * geometry.agreeing_share
              << " % of the matched features): a map of places\n";
    return;
  }
  std::cout << session.name << ": " << geometry.located << " of " << session.kept
            << " images with landmarks: " << geometry.landmarks << " landmarks, " << geometry.sightings
            << " sightings, median error " << std::setprecision(2) << geometry.median_error_px
            << " px; images moved the cleaned path by " << geometry.mean_shift_m << " m on average, "
            << geometry.largest_shift_m << " m at most; focal length by the images " << 100.0 * geometry.focal_scale
            << " % of the calibration's; fixes come " << std::showpos << geometry.fix_delay_s << std::noshowpos
            << " s late\n";
  if (geometry.tied_apart_m > 0.0) {
    std::cout << session.name << ": tied to the sessions before, which had the same " << geometry.tied_apart_m
              << " m away\n";
  }
  std::cout << std::setprecision(1);
}

/// What one session brought, and whether its images were distorted to fit.
void printImages(const SessionImages& session, cv::Size in_map) {
  std::cout << session.name << ": " << session.kept << " images";
  if (session.kept != 0) std::cout << " of " << session.recorded.width << 'x' << session.recorded.height << " px";
  if (session.kept != 0 && session.recorded != in_map) {
    std::cout << ", resized to " << in_map.width << 'x' << in_map.height;
    const double stretch = stretchOf(session.recorded, in_map);
    constexpr double kHarmless = 0.02;
    if (std::abs(stretch - 1.0) > kHarmless) {
      std::cout << "; this distorts them (width times " << std::setprecision(2) << stretch << std::setprecision(1)
                << "): only the same camera will recognise them";
    }
  }
  std::cout << '\n';
}

/// The size of the map's images is that of the first.
void printSessionImages(const std::vector<SessionImages>& sessions) {
  const auto first = std::find_if(sessions.begin(), sessions.end(), [](const auto& session) { return session.kept; });
  for (const SessionImages& session : sessions) printImages(session, first->recorded);
}

void printReport(const MapBuilderOptions& options, const MapBuildReport& report, const GeometryConfig& geometry,
                 const std::vector<PlottedSession>& sessions) {
  std::cout << std::fixed << std::setprecision(1);
  for (const SessionImages& session : report.session_images) printCamera(session, options, geometry);
  for (const SessionImages& session : report.session_images) printMount(session);
  for (const PlottedSession& session : sessions) printFixes(session);
  for (const SessionImages& session : report.session_images) {
    if (geometry.enabled) printGeometry(session);
  }
  if (sessions.size() > 1) printSessionImages(report.session_images);
  std::cout << "images: " << (report.images_kept - report.images_thinned) << " kept, " << report.images_without_position
            << " without position, " << report.images_too_close << " too close, " << report.images_thinned
            << " left out after the adjustment, " << report.images_disordered << " out of order, "
            << report.images_unusable << " unusable\n";
  const double dropped = report.features_extracted == 0 ? 0.0
                                                        : 100.0 - 100.0 * static_cast<double>(report.features_kept) /
                                                                      static_cast<double>(report.features_extracted);
  std::cout << "features: " << report.features_extracted << " extracted, " << report.features_kept
            << " kept after pruning (" << dropped << " % dropped)\n";
}

std::size_t fixesKept(const MapBuildReport& report) {
  std::size_t kept = 0;
  for (const CleanedTrajectory& session : report.sessions) {
    kept += static_cast<std::size_t>(std::count(session.verdicts.begin(), session.verdicts.end(), FixVerdict::kKept));
  }
  return kept;
}

void printSummary(const MapBuilderOptions& options, const MapBuildReport& report, double seconds) {
  std::size_t fixes = 0;
  std::size_t gaps = 0;
  for (const CleanedTrajectory& session : report.sessions) {
    fixes += session.verdicts.size();
    gaps += session.gaps_closed;
  }
  std::cout << options.output << ": " << (report.images_kept - report.images_thinned) << " images, "
            << fixesKept(report) << " of " << fixes << " fixes, " << gaps << " gaps closed, features "
            << report.features_extracted << " -> " << report.features_kept << ", "
            << humanSize(static_cast<double>(std::filesystem::file_size(options.output))) << ", " << seconds << " s\n";
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
  MapBuilder builder(config, {options.threads, options.output});
  std::vector<PlottedSession> sessions;
  for (const std::string& bag : options.bags) addSession(builder, bag, options, config, sessions);
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
