// Localises a recorded drive against a map: what the robot does, without a robot.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/app_support.h"
#include "apps/bag_sessions.h"
#include "apps/command_line.h"
#include "apps/config_values.h"
#include "apps/drive_report.h"
#include "apps/track_header.h"
#include "bag/recorded_mount.h"
#include "base/files.h"
#include "editing/map_selection.h"
#include "evaluation/evaluator.h"
#include "evaluation/metrics.h"
#include "evaluation/round_recorder.h"
#include "evaluation/run.h"
#include "node/node_config.h"
#include "ros/message_readers.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization::apps {
namespace {

/// Odometry of the drive, as the robot would get it: up to the stamp of an image before the image. What lies between
/// two images that do not follow each other was not driven.
class OdometryFeed {
 public:
  explicit OdometryFeed(std::vector<OdometryReading> readings) : readings_(std::move(readings)) {
    std::stable_sort(readings_.begin(), readings_.end(), isBefore);
  }

  void feed(std::int64_t stamp_ns, bool follows, Localizer& localizer) {
    if (!follows) next_ = first(stamp_ns - kBefore_ns);
    for (; next_ < readings_.size() && readings_[next_].stamp_ns <= stamp_ns; ++next_) {
      localizer.addOdometry(readings_[next_]);
    }
  }

 private:
  static constexpr std::int64_t kBefore_ns = 500'000'000;

  static bool isBefore(const OdometryReading& a, const OdometryReading& b) { return a.stamp_ns < b.stamp_ns; }

  std::size_t first(std::int64_t stamp_ns) const {
    const auto found =
        std::lower_bound(readings_.begin(), readings_.end(), OdometryReading{stamp_ns, {}, 0.0}, isBefore);
    return static_cast<std::size_t>(found - readings_.begin());
  }

  std::vector<OdometryReading> readings_;
  std::size_t next_ = 0;
};

/// What the options set.
ParameterValues valuesOf(const LocalizeOptions& options) {
  ParameterValues given;
  if (!options.preset.empty()) given["preset"] = options.preset;
  if (!options.tracker.empty()) given["tracker"] = options.tracker;
  if (!options.features.empty()) given["features"] = options.features;
  if (!options.model.empty()) given["model"] = options.model;
  if (!options.match.empty()) given["match/mode"] = options.match;
  if (!options.pose_source.empty()) given["pose_source"] = options.pose_source;
  if (options.seed) given["seed"] = *options.seed;
  if (options.map_cache_mb) given["map_cache_mb"] = *options.map_cache_mb;
  localizerValues(given);  // what contradicts a preset is refused, even where it is a default
  return given;
}

/// The file is the node's: parameters of the node alone are checked, but not used. The number of particles is the
/// user's under a preset too: the papers try several.
NodeParameters configOf(const LocalizeOptions& options) {
  auto config = joinedConfig<NodeParameters>(
      options.config, options.preset, [&options] { return valuesOf(options); }, localizerValues);
  try {
    if (options.particles) {
      assignParameters(config, {{trackerKind(config.localizer.tracker).particles, *options.particles}});
    }
  } catch (const ParameterError& error) {
    throw UsageError(error.what());
  }
  return config;
}

std::vector<std::size_t> orderOf(const LocalizeOptions& options, std::size_t images) {
  std::optional<Kidnapping> kidnapping;
  if (options.kidnap_at) kidnapping = Kidnapping{*options.kidnap_at, *options.kidnap_to};
  try {
    return imageOrder(images, options.start_index, kidnapping);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

/// What a run adds up to.
struct Totals {
  std::size_t images = 0;
  std::size_t unusable = 0;
  std::map<LocalizationState, std::map<StateReason, std::size_t>> states;  ///< images
  std::size_t metric = 0;
  std::string camera_trouble;
  double comparisons = 0.0;
  double swept = 0.0;
  double extract_ms = 0.0;
  double match_ms = 0.0;
  double update_ms = 0.0;

  void add(const Estimate& estimate) {
    ++images;
    ++states[estimate.state][estimate.why.reason];
    if (estimate.source == PoseSource::kMetric) ++metric;
    camera_trouble = estimate.cameraTrouble();
    comparisons += static_cast<double>(estimate.comparisons);
    swept += static_cast<double>(estimate.swept);
    extract_ms += estimate.image.extract_ms;
    match_ms += estimate.image.match_ms;
    update_ms += estimate.update_ms;
  }
};

/// A line for each state: its share, and those of its reasons, the largest first.
void printStates(const Totals& totals) {
  const auto share = [&totals](std::size_t count) {
    return 100.0 * static_cast<double>(count) / static_cast<double>(totals.images);
  };
  for (const auto& [state, reasons] : totals.states) {
    std::vector<std::pair<std::size_t, StateReason>> largest;
    std::size_t all = 0;
    for (const auto& [reason, count] : reasons) largest.emplace_back(count, reason), all += count;
    std::sort(largest.rbegin(), largest.rend());
    std::string words;
    for (const auto& [count, reason] : largest) {
      std::array<char, 64> text{};
      std::snprintf(text.data(), text.size(), "%s %s %.1f %%", words.empty() ? ":" : ",", textOf(reason).name,
                    share(count));
      words += text.data();
    }
    std::printf("%s %.1f %%%s\n", toString(state).c_str(), share(all), words.c_str());
  }
}

void print(const Totals& totals) {
  const auto images = static_cast<double>(totals.images);
  std::printf("images %zu, not usable %zu, METRIC %.1f %%\n", totals.images, totals.unusable,
              100.0 * static_cast<double>(totals.metric) / images);
  printStates(totals);
  std::printf("comparisons per image %.1f, swept %.1f\n", totals.comparisons / images, totals.swept / images);
  std::printf("ms per image %.2f (extract %.2f, match %.2f, update %.3f)\n",
              (totals.extract_ms + totals.match_ms + totals.update_ms) / images, totals.extract_ms / images,
              totals.match_ms / images, totals.update_ms / images);
}

void print(const ErrorStatistics& errors) {
  if (errors.count == 0) {
    std::printf("error: no image has a true position\n");
    return;
  }
  std::printf("error: mean %.2f m, median %.2f m, within 5 m %.1f %% of %zu images with a true position\n",
              errors.mean_m, errors.median_m, 100.0 * errors.within_5m, errors.count);
}

/// Nothing when it cannot be used: that does not end the run, and the first reason is kept.
std::optional<Estimate> localizeImage(const BagImage& image, std::size_t index, Localizer& localizer, cv::Mat& grey,
                                      std::string& reason) {
  std::string refusal;
  try {
    grey = image.decode();
    return localizer.process(image.stamp_ns, grey);
  } catch (const ImageError& error) {
    refusal = error.what();
  } catch (const std::invalid_argument& error) {
    refusal = error.what();
  }
  if (reason.empty()) reason = "image " + std::to_string(index) + ": " + refusal;
  return std::nullopt;
}

/// Of the first image that can be decoded.
std::optional<cv::Size> recordedSize(const BagImages& images) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    try {
      return images.read(i).decode().size();
    } catch (const ImageError&) {
    }
  }
  return std::nullopt;
}

/// By the parameter, the bag, or the map.
void setMount(const LocalizeOptions& options, const NodeConfig& config, const BagReader& bag, Localizer& localizer) {
  std::optional<RobotMount> found;
  if (!config.camera_mount.empty()) {
    found.emplace().mount.camera = parseCameraMount(config.camera_mount);
    found->said = "by the parameter";
  } else {
    found = recordedMount(bag, {config.base_frame_id, options.image_topic});
  }
  if (!found) return;
  localizer.setMount(found->mount);
  const Eigen::Vector3d& camera_m = found->mount.camera.position_m;
  std::printf("robot: camera at %.2f %.2f %.2f m in %s (%s)\n", camera_m.x(), camera_m.y(), camera_m.z(),
              config.base_frame_id.c_str(), found->said.c_str());
}

/// Of the options, the calibration in the bag, or the map. Says which.
void setCamera(const LocalizeOptions& options, const NodeConfig& config, const BagReader& bag, const BagImages& images,
               Localizer& localizer) {
  const std::optional<cv::Size> size = recordedSize(images);
  std::string from = "the map";
  const std::optional<CameraModel> of_map = localizer.camera();
  const bool named = !options.camera_info.empty();
  const std::optional<CameraModel> camera =
      named ? readCameraFile(options.camera_info) : bag.camera(options.image_topic);
  if (camera) {
    localizer.setCamera(size ? fittedTo(*size, *camera) : *camera);
    from = named ? options.camera_info : cameraInfoTopic(options.image_topic);
  }
  if (!options.mask.empty()) {
    const Mask mask = readMask(options.mask);
    localizer.setMask(size ? fittedTo(*size, mask) : mask);
  }
  if (!localizer.camera()) {
    std::printf("camera: no calibration (no camera_info, no --camera-info, none in the map): places only\n");
    return;
  }
  setMount(options, config, bag, localizer);
  std::printf("camera: %s, from %s\n", describe(camera ? *camera : *localizer.camera()).c_str(), from.c_str());
  const std::string other = of_map ? differences(*localizer.camera(), *of_map) : "";
  if (!other.empty()) std::printf("camera: not the map's: %s\n", other.c_str());
}

/// As good as pose and map together.
Fix toFix(const Estimate& estimate) {
  Fix fix{estimate.stamp_ns, estimate.pose.geodetic, true};
  fix.sigma_m = std::sqrt(0.5 * estimate.pose.covariance_m2.trace());
  return fix;
}

/// Refuses what could only fail after the work.
void requireExtension(const LocalizeOptions& options, const LocalizerConfig& config,
                      const std::vector<std::string>& inputs) {
  if (options.extend.empty()) return;
  if (options.kidnap_at || options.start_index > 0) {
    throw UsageError("--extend needs the drive as it was recorded, without --start-index and --kidnap-at");
  }
  if (config.metric.pose_source != "metric") throw UsageError("--extend needs --pose-source metric");
  requireNoInput("--extend", options.extend, inputs);
  const PartialFile attempt(options.extend);
}

/// Once map and camera are there.
void requireExtensible(const LocalizeOptions& options, const Localizer& localizer,
                       const std::shared_ptr<const TrainingMap>& map) {
  if (options.extend.empty()) return;
  if (!map->hasGeometry()) {
    throw std::runtime_error("--extend: " + options.map + " has no landmarks, so it verifies no pose");
  }
  if (!localizer.camera()) throw std::runtime_error("--extend: without calibration no pose is verified");
  requireNewRecording(options.bag, options.image_topic, {options.map, map});
}

void extend(const LocalizeOptions& options, const Localizer& localizer, std::vector<Fix> poses, const MapUsage& usage) {
  if (poses.empty()) throw std::runtime_error("--extend: no verified pose, so nothing to add to " + options.map);
  const OutputLock lock(options.extend);
  VerifiedDrive drive;
  drive.poses = std::move(poses);
  drive.camera.model = localizer.camera();
  drive.camera.mask = localizer.mask();
  drive.camera.mount = localizer.mount();
  drive.camera.mount->antenna_m.setZero();
  MapBuilderOptions build;
  build.bags = {options.bag};
  build.image_topic = options.image_topic;
  build.fix_topic = "verified poses";
  build.output = options.extend;
  addDrive({options.map, openMap(options.map, 2)}, drive, build, usage, options.extend,
           provenance("localize", "extension", {options.map, options.bag}));
}

OdometryFeed odometryOf(const LocalizeOptions& options, const NodeConfig& config, const BagReader& bag) {
  if (options.odom_topic.empty()) return OdometryFeed({});
  return OdometryFeed(bag.odometry(options.odom_topic, config.base_frame_id, config.global_frame_id));
}

/// What a drive comes to.
struct DriveResult {
  std::string track = trackCsvHeader();
  Totals totals;
  std::string first_refusal;  ///< of an image that cannot be used
  std::vector<double> errors_m;
  MapUsage usage;
  std::vector<Fix> verified;  ///< poses

  std::optional<DriveReport> report;

  void add(const Estimate& estimate, const Localizer& localizer, const cv::Mat& grey,
           const std::optional<Trajectory>& truth) {
    track += trackCsvRow(estimate);
    totals.add(estimate);
    if (estimate.source == PoseSource::kMetric) usage.add(localizer.map(), localizer.lastLandmarks());
    if (estimate.evidence.verified.value_or(false)) verified.push_back(toFix(estimate));
    const auto true_point = truth ? truth->at(estimate.stamp_ns) : std::nullopt;
    if (true_point) errors_m.push_back((estimate.pose.position_m - true_point->position_m).norm());
    std::optional<Eigen::Vector2d> true_m;
    if (true_point) true_m = true_point->position_m;
    if (report) report->add(estimate, localizer, grey, true_m);
  }
};

DriveResult localizeDrive(const BagImages& images, const std::vector<std::size_t>& order,
                          const std::optional<Trajectory>& truth, OdometryFeed odometry, Localizer& localizer,
                          std::optional<DriveReport> report) {
  DriveResult result;
  result.report = std::move(report);
  cv::Mat grey;
  ProgressBar progress("localize");
  for (std::size_t step = 0; step < order.size(); ++step) {
    progress.show(step, order.size());
    const bool follows = step > 0 && order[step] == order[step - 1] + 1;
    const BagImage image = images.read(order[step]);
    odometry.feed(image.stamp_ns, follows, localizer);
    const std::optional<Estimate> estimate = localizeImage(image, order[step], localizer, grey, result.first_refusal);
    if (estimate) {
      result.add(*estimate, localizer, grey, truth);
    } else {
      ++result.totals.unusable;
    }
  }
  progress.show(order.size(), order.size());
  return result;
}

void print(const DriveResult& result, bool has_truth) {
  if (!result.first_refusal.empty()) {
    warn("localize: " + std::to_string(result.totals.unusable) + " images skipped, first " + result.first_refusal);
  }
  if (!result.totals.camera_trouble.empty()) warn("localize: camera: " + result.totals.camera_trouble);
  print(result.totals);
  if (has_truth) print(summarise(result.errors_m));
}

constexpr const char* kHeaderSuffix = ".yaml";

void requireOutputs(const LocalizeOptions& options, const LocalizerConfig& config) {
  std::vector<std::string> inputs{options.map, options.bag, options.config, options.camera_info, options.mask};
  for (const std::string& output : {options.output, options.output + kHeaderSuffix}) {
    requireNoInput("--output", output, inputs);
    inputs.push_back(output);
  }
  if (!options.usage.empty()) requireNoInput("--usage", options.usage, inputs);
  if (!options.report.empty()) requireNoInput("--report", options.report, inputs);
  requireExtension(options, config, inputs);
}

void run(const LocalizeOptions& options) {
  const NodeParameters config = configOf(options);
  requireOutputs(options, config.localizer);
  PartialFile output(options.output);  // fails now, not after the run
  PartialFile header(options.output + kHeaderSuffix);
  std::optional<PartialFile> usage_file;
  if (!options.usage.empty()) usage_file.emplace(options.usage);
  std::optional<PartialFile> report_file;
  std::optional<DriveReport> report;
  if (!options.report.empty()) {
    report_file.emplace(options.report);
    report.emplace(options.bag, options.image_topic);
  }
  const auto warn_of_map = [](const std::string& reason) { warn("localize: " + reason); };
  const std::shared_ptr<const TrainingMap> map = loadMap(options.map, config.node.mapLoading(warn_of_map));
  Localizer localizer(map, config.localizer);
  const BagReader bag(options.bag);
  const BagImages images = bag.images(options.image_topic);
  const std::vector<std::size_t> order = orderOf(options, images.size());
  setCamera(options, config.node, bag, images, localizer);
  requireExtensible(options, localizer, map);
  std::optional<Trajectory> truth;
  if (!options.truth_topic.empty()) truth = trueTrajectory(bag, options.truth_topic, localizer.map().frame());

  DriveResult drive =
      localizeDrive(images, order, truth, odometryOf(options, config.node, bag), localizer, std::move(report));
  if (drive.totals.images == 0) {
    throw BagError(options.bag + ": no usable image on " + images.topic() + ": " + drive.first_refusal);
  }
  output.write(drive.track);
  header.write(trackHeader(options, config.localizer, localizer));
  output.commit();
  header.commit();
  if (usage_file) usage_file->write(drive.usage.toCsv());
  if (usage_file) usage_file->commit();
  if (report_file) report_file->write(drive.report->page(options.map, *map));
  if (report_file) report_file->commit();
  print(drive, truth.has_value());
  if (!options.extend.empty()) extend(options, localizer, std::move(drive.verified), drive.usage);
}

}  // namespace
}  // namespace visual_localization::apps

int main(int argc, char** argv) {
  return visual_localization::apps::runProgram(argc, argv, visual_localization::apps::run);
}
