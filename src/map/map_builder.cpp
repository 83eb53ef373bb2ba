#include "visual_localization/map/map_builder.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/files.h"
#include "base/time.h"
#include "features/image_size.h"
#include "geometry/fix_budget.h"
#include "map/extraction_pool.h"
#include "map/map_geometry.h"
#include "map/map_writer.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/front_end.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/parameters/presets.h"

namespace visual_localization {
namespace {

constexpr std::size_t kWaitingPerThread = 4;  ///< images: so that no thread waits long for the slowest

/// With what the model says of the features.
MapBuilderConfig adopted(MapBuilderConfig config) {
  config.local.chosen().adopt(config.model);
  return config;
}

bool isOfShape(cv::Size recorded, cv::Size wanted) {
  constexpr double kRounding = 0.02;
  return std::abs(stretchOf(recorded, wanted) - 1.0) <= kRounding;
}

cv::Size requireBounded(const std::string& session, cv::Size size) {
  if (const auto reason = whyTooLarge(size)) {
    throw std::runtime_error("session '" + session + "': its images are too large: " + *reason);
  }
  return size;
}

/// The unpruned features of the images that tell what is noise in image `i`.
std::vector<std::shared_ptr<const LocalFeatures>> neighboursOf(std::size_t i, const PruningNeighbours& neighbours,
                                                               const TrainingMap& unpruned) {
  std::vector<std::shared_ptr<const LocalFeatures>> features;
  for (const std::size_t neighbour : neighbours.of(i)) features.push_back(unpruned.local(neighbour));
  return features;
}

std::vector<const LocalFeatures*> pointersTo(const std::vector<std::shared_ptr<const LocalFeatures>>& owned) {
  std::vector<const LocalFeatures*> pointers;
  for (const auto& features : owned) pointers.push_back(features.get());
  return pointers;
}

std::string whyNone(const MapBuildReport& report) {
  const std::vector<std::pair<std::size_t, const char*>> reasons{
      {report.images_disordered, "stamped not after the one that was recorded before"},
      {report.images_without_position, "before the first or after the last believable fix"},
      {report.images_of_other_shape, "of another shape than most"},
      {report.images_unusable, "unusable"},
      {report.images_standing, "of a robot that stood"}};
  std::string text;
  for (const auto& [count, reason] : reasons) {
    if (count > 0) text += (text.empty() ? ": " : ", ") + std::to_string(count) + ' ' + reason;
  }
  return text;
}

}  // namespace

MapBuilder::MapBuilder(const MapBuilderConfig& config, const MapBuilderResources& resources,
                       const std::optional<MapBase>& base)
    : config_(adopted(requireValid(config))),
      resources_(resources),
      extraction_(std::make_unique<ExtractionPool>(config_.local.chosen(), config_.model, resources.threads)),
      most_waiting_(resources.threads > 1 ? kWaitingPerThread * resources.threads : 1),
      spool_(std::make_unique<ImageSpool>(resources.spool_beside, config_.local.chosen().clone())) {
  header_.kind = config_.local.chosen().clone();
  header_.preset = config_.preset;
  if (!base) return;
  frame_ = LocalFrame(base->datum);
  header_.image_size = report_.image_size = base->image_size;
}

MapBuilder::~MapBuilder() = default;

void MapBuilder::beginSession(const std::string& name, const std::vector<Fix>& fixes, const SessionCamera& camera) {
  try {
    const LocalFrame frame = frame_ ? *frame_ : frameFor(fixes, config_.trajectory);
    requireNear(fixes, frame.datum());
    CleanedTrajectory cleaned = cleanTrajectory(fixes, frame, config_.trajectory);
    requireMotion(cleaned);
    report_.sessions.push_back(std::move(cleaned));
    frame_ = frame;
  } catch (const std::exception& error) {
    throw std::runtime_error("session '" + name + "': " + error.what());
  }
  header_.datum = frame_->datum();
  header_.sessions.push_back({name, {}, {}, camera.mount});
  fixes_.push_back(inFrame(fixes, report_.sessions.back().verdicts, *frame_));
  report_.session_images.push_back({name, 0, camera.image_size, camera, false, {}, {}});
  last_stamp_ns_.reset();
  last_kept_m_.reset();
  came_to_.reset();
}

bool MapBuilder::wants(std::int64_t stamp_ns, cv::Size recorded) {
  if (report_.sessions.empty()) throw std::logic_error("map builder: image before the first session");
  if (last_stamp_ns_ && stamp_ns <= *last_stamp_ns_) {
    ++report_.images_disordered;
    return false;
  }
  last_stamp_ns_ = stamp_ns;
  const std::optional<TrajectoryPoint> point = report_.sessions.back().trajectory.at(stamp_ns);
  if (!point) {
    ++report_.images_without_position;
    return false;
  }
  if (last_kept_m_ && (point->position_m - *last_kept_m_).norm() < config_.min_spacing_m) {
    ++report_.images_too_close;
    return false;
  }
  if (stands(*point)) {
    ++report_.images_standing;
    return false;
  }
  return recorded.empty() || fits(recorded);
}

/// Also of a robot that turns on its spot, kStandingTime_s of images are wanted. One that crawls has come half as far
/// by then as its recording does on average.
bool MapBuilder::stands(const TrajectoryPoint& at) {
  if (!came_to_) came_to_ = at;
  const double way_m = (at.position_m - came_to_->position_m).norm();
  const auto rested = [&] { return secondsBetween(came_to_->stamp_ns, at.stamp_ns) > kStandingTime_s; };
  const auto usual_m = [this] {
    const Trajectory& path = report_.sessions.back().trajectory;
    const double time_s = secondsBetween(path.points().front().stamp_ns, path.points().back().stamp_ns);
    return 0.5 * kStandingTime_s * path.length() / time_s;
  };
  if (way_m >= kStandingReach_m || (rested() && way_m >= usual_m())) came_to_ = at;
  return rested();
}

/// Whether an image of this size belongs into the session. Counts it when it does not.
bool MapBuilder::fits(cv::Size recorded) {
  SessionImages& session = report_.session_images.back();
  if (session.camera.image_size.empty() || isOfShape(recorded, session.recorded)) return true;
  ++session.other_sizes[{recorded.width, recorded.height}];
  ++report_.images_of_other_shape;
  return false;
}

void MapBuilder::addImage(std::int64_t stamp_ns, const cv::Mat& grey) {
  if (report_.sessions.empty()) throw std::logic_error("map builder: image before the first session");
  const std::optional<TrajectoryPoint> point = report_.sessions.back().trajectory.at(stamp_ns);
  if (!point || !isExtractable(grey)) {
    ++(point ? report_.images_unusable : report_.images_without_position);
    return;
  }
  if (!fits(grey.size())) return;
  SessionImages& session = report_.session_images.back();
  if (session.recorded.empty()) session.recorded = grey.size();
  if (header_.image_size.empty()) {
    const cv::Size recorded = requireBounded(session.name, session.recorded);
    header_.image_size = report_.image_size = halvedTo(config_.max_megapixels, recorded);
  }
  if (session.kept == 0) fitCamera();
  if (grey.size() != session.recorded) ++session.other_sizes[{grey.cols, grey.rows}];
  RawImage image;
  image.pose = {stamp_ns, static_cast<int>(header_.sessions.size()) - 1, point->position_m, point->yaw_rad};
  // A camera's or a decoder's buffer does not stay.
  cv::Mat resized;
  image.grey = fitted(grey, header_.image_size, resized).clone();
  image.mask = header_.sessions.back().mask;
  waiting_.push_back(std::move(image));
  last_kept_m_ = point->position_m;
  ++session.kept;
  ++report_.images_kept;
  if (waiting_.size() >= most_waiting_) extractWaiting();
}

/// Camera and mask of a session for images of the map's size; those it has recorded are resized to it.
void MapBuilder::fitCamera() {
  const SessionCamera& camera = report_.session_images.back().camera;
  const cv::Size recorded = report_.session_images.back().recorded;
  Session& session = header_.sessions.back();
  try {
    if (camera.model) session.camera = fittedTo(recorded, *camera.model).scaledTo(header_.image_size);
    session.mask = fittedTo(recorded, camera.mask).scaledTo(header_.image_size);
  } catch (const CameraError& error) {
    throw CameraError("session '" + session.name + "': " + error.what());
  }
}

void MapBuilder::extractWaiting() {
  for (const TrainingImage& image : extraction_->extract(waiting_)) {
    report_.features_extracted += image.local.size();
    spool_->append(image);
  }
  waiting_.clear();
}

void MapBuilder::finish(const Sink& sink, const Progress& progress) {
  if (report_.images_kept == 0) throw std::runtime_error("no image was kept, so there is no map" + whyNone(report_));
  extractWaiting();
  const std::shared_ptr<const TrainingMap> unpruned = spool_->finish(header_);
  if (config_.geometry.enabled && config_.geometry.self_calibration) calibrate(*unpruned);
  std::vector<std::optional<SessionGeometry>> geometries(header_.sessions.size());
  std::vector<double> clock_sigmas_s;
  for (const SessionImages& session : report_.session_images) clock_sigmas_s.push_back(session.camera.clock_sigma_s);
  if (adjusts()) {
    geometries = geometryOf(*unpruned, header_.sessions, fixes_, clock_sigmas_s, config_.geometry, resources_.threads);
  }
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    FixBudget& budget = report_.session_images[i].fixes;
    budget = fixBudget(report_.sessions[i].trajectory, fixes_[i], config_.geometry);
    header_.sessions[i].fixes = budget;
    if (!geometries[i]) continue;
    report_.session_images[i].geometry = *geometries[i];  // without poses and landmarks
    Session& session = header_.sessions[i];
    session.doubtful = geometries[i]->doubtful;
    if (geometries[i]->contradicts_calibration || geometries[i]->contradicts_fixes) {
      session.fixes->sigma_m = budget.sigma_m = std::max(budget.sigma_m, geometries[i]->fixes.sigma_m);
      geometries[i].reset();
      session.camera.reset();
      continue;
    }
    session.fixes = budget = geometries[i]->fixes;
    if (geometries[i]->found_camera) session.mount = SensorMount{*geometries[i]->found_camera};
    if (const CameraModel adjusted(geometries[i]->lens); adjusted != *session.camera) {
      session.published = std::exchange(session.camera, adjusted);
    }
  }
  const PruningNeighbours neighbours(*unpruned);
  learnVocabulary(*unpruned, neighbours);
  report_.features_kept = 0;
  const auto pruned = [&](std::size_t i, TrainingImage& image) {
    prune(i, *unpruned, neighbours, image);
    report_.features_kept += image.local.size();
    if (header_.vocabulary) image.vlad = header_.vocabulary->describe(image.local);
    if (progress) progress(i + 1, unpruned->size());
  };
  report_.images_thinned += writeThinned(*unpruned, header_.sessions, std::move(geometries), config_, pruned, sink);
}

/// Those sessions that nobody has calibrated, as far as their images say how.
void MapBuilder::calibrate(const TrainingMap& unpruned) {
  const auto cameras = calibrateByImages(unpruned, header_.sessions, fixes_, config_.geometry, resources_.threads);
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    if (!cameras[k]) continue;
    SessionImages& session = report_.session_images[k];
    header_.sessions[k].camera = cameras[k];
    session.camera.model = cameras[k]->scaledTo(session.recorded);
    session.calibrated_by_images = true;
  }
}

bool MapBuilder::adjusts() const {
  return config_.geometry.enabled && (config_.geometry.self_calibration || hasCalibratedSession());
}

bool MapBuilder::hasCalibratedSession() const {
  return std::any_of(header_.sessions.begin(), header_.sessions.end(),
                     [](const Session& session) { return session.camera.has_value(); });
}

/// `image`: the i-th of `unpruned`, where it will be in the map. On its own it has nothing to be compared with: it
/// keeps all its features.
void MapBuilder::prune(std::size_t i, const TrainingMap& unpruned, const PruningNeighbours& neighbours_of,
                       TrainingImage& image) const {
  if (!config_.prune) return;
  const auto neighbours = neighboursOf(i, neighbours_of, unpruned);
  if (neighbours.empty()) return;
  keepFeatures(seenIn(image.local, pointersTo(neighbours), config_.match.max_angle_ratio), image);
}

void MapBuilder::learnVocabulary(const TrainingMap& unpruned, const PruningNeighbours& neighbours) {
  const auto features = [&](std::size_t i) {
    if (!config_.prune) return unpruned.local(i);
    TrainingImage image;
    image.local = *unpruned.local(i);
    prune(i, unpruned, neighbours, image);
    return std::shared_ptr<const LocalFeatures>(std::make_shared<LocalFeatures>(std::move(image.local)));
  };
  header_.vocabulary = VladVocabulary::learn(unpruned.size(), features, header_.image_size);
}

std::shared_ptr<const TrainingMap> MapBuilder::build(const Progress& progress) {
  std::vector<TrainingImage> images;
  finish([&images](const TrainingImage& image) { images.push_back(image); }, progress);
  return std::make_shared<const TrainingMap>(header_, std::move(images));
}

void MapBuilder::save(const std::string& path, const Progress& progress) {
  MapWriter writer(path, header_.kind);
  write(writer, progress);
}

void MapBuilder::save(const PartialFile& file, const Progress& progress) {
  MapWriter writer(file, header_.kind);
  write(writer, progress);
}

void MapBuilder::write(MapWriter& writer, const Progress& progress) {
  finish([&writer](const TrainingImage& image) { writer.append(image); }, progress);
  writer.finish(header_);
}

namespace {

template <class Parse>
bool canParse(const std::string& text, Parse parse) {
  try {
    if (!text.empty()) parse(text);
    return true;
  } catch (const MountError&) {
    return false;
  }
}

void requireMountTexts(ParameterVisitor& visitor, const std::string& camera, const std::string& antenna) {
  visitor.require(canParse(camera, parseCameraMount), "robot/camera", "'" + camera + "'",
                  "six numbers: x y z yaw pitch roll, metres (at most 100) and radians (at most 2 pi; no degrees)");
  visitor.require(canParse(antenna, parseAntennaMount), "robot/antenna", "'" + antenna + "'",
                  "three numbers: x y z, metres, at most 100");
}

}  // namespace

ParameterValues mapBuilderValues(const ParameterValues& given, const ParameterValues& defaults) {
  const Preset* preset = parameters::presetOf(given);
  return preset == nullptr ? given : withPreset(*preset, preset->map_builder, given, defaults);
}

void MapBuilderConfig::declare(ParameterVisitor& visitor) {
  visitor.choice(
      {"preset", "",
       "parameters of the papers' text or of the authors' program in place of the defaults; other values are "
       "refused beside it"},
      preset, presetChoices());
  visitor.real({"map/min_spacing", "m", "skip an image closer than this to the last kept one of its session"},
               min_spacing_m, 0.0, 1000.0);
  visitor.real(
      {"map/spacing", "m",
       "keep, after all images were pruned and adjusted, only those at least this far from the last kept one of their "
       "session"},
      spacing_m, 0.0, 1000.0);
  visitor.real(
      {"map/max_megapixels", "Mpx",
       "the map has images of half of the width and height, or a quarter and so on, of a camera that has more, "
       "and live images are resized to them; 0: as recorded"},
      max_megapixels, 0.0, 1000.0);
  visitor.flag(
      {"map/prune", "", "keep only features that one of the two nearest training images of its session shows too"},
      prune);
  visitor.text({"map/model", "", "ONNX file of learned features"}, model);
  visitor.text({"robot/base_frame", "", "frame of the robot in /tf_static"}, base_frame);
  visitor.text({"robot/camera", "m, rad",
                "x y z yaw pitch roll of the camera (x ahead) on the robot; empty: from /tf_static, or the robot is "
                "where the camera is"},
               camera_mount);
  visitor.text({"robot/antenna", "m", "x y z of the antenna on the robot; empty: likewise"}, antenna_mount);
  visitor.text({"robot/fix_frame", "",
                "frame of the receiver whose fixes count, where several share a topic; empty: the one with most fixes"},
               fix_frame);
  requireMountTexts(visitor, camera_mount, antenna_mount);
  local.declare(visitor);
  match.declare(visitor);
  trajectory.declare(visitor);
  geometry.declare(visitor);
}

}  // namespace visual_localization
