#include "evaluation/round_recorder.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/files.h"
#include "base/time.h"
#include "features/image_size.h"
#include "ros/message_readers.h"
#include "visual_localization/camera/mask.h"
#include "visual_localization/features/front_end.h"

namespace visual_localization {
namespace {

using Truth = std::function<std::optional<TruePose>(std::int64_t stamp_ns)>;

/// In the frame of its true positions; none when it has no file of them.
Trajectory truePoses(const BagReader& bag, const RoundSpec& recording, const Trajectory& positions) {
  if (recording.poses.empty()) return {};
  const std::string path = besideBag(bag.path(), recording.poses);
  const Trajectory poses = readPoses(path);
  try {
    return movedOnto(positions, poses);
  } catch (const std::runtime_error& error) {
    throw FileError(path + ": " + error.what() + " (" + recording.truth_topic + " in " + bag.path() + ")");
  }
}

/// The topic that maps are made from is no better than a map: it is cleaned like one.
Truth truthOf(const BagReader& bag, const RoundSpec& recording, const TrajectoryCleanerConfig& config) {
  const std::vector<Fix> fixes = bag.fixes(recording.truth_topic);
  const auto first = std::find_if(fixes.begin(), fixes.end(), hasPosition);
  if (first == fixes.end())
    throw BagError(bag.path() + ": topic " + recording.truth_topic + " holds no believable fix");
  const GeodeticPoint datum{first->position.latitude_deg, first->position.longitude_deg, 0.0};
  const LocalFrame frame(datum);
  Trajectory trajectory = recording.truth_topic == recording.fix_topic
                              ? cleanTrajectory(fixes, frame, config).trajectory
                              : trueTrajectory(bag, recording.truth_topic, frame);
  Trajectory poses = truePoses(bag, recording, trajectory);
  return [frame, trajectory = std::move(trajectory),
          poses = std::move(poses)](std::int64_t stamp_ns) -> std::optional<TruePose> {
    if (const auto pose = poses.at(stamp_ns)) return TruePose{frame.toGeodetic(pose->position_m), pose->yaw_rad};
    const std::optional<TrajectoryPoint> point = trajectory.at(stamp_ns);
    if (!point) return std::nullopt;
    return TruePose{frame.toGeodetic(point->position_m)};
  };
}

std::optional<CameraModel> cameraOf(const BagReader& bag, const RoundSpec& recording) {
  if (recording.camera_info.empty()) return bag.camera(recording.image_topic);
  return readCameraFile(besideBag(bag.path(), recording.camera_info));
}

/// Without those that cannot be used.
void forEachImage(const BagReader& bag, const std::string& topic,
                  const std::function<void(std::int64_t stamp_ns, const cv::Mat& grey)>& use) {
  const BagImages images = bag.images(topic);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const BagImage image = images.read(i);
    try {
      const cv::Mat grey = image.decode();
      requireExtractable(grey);
      use(image.stamp_ns, grey);
    } catch (const ImageError&) {
    } catch (const std::invalid_argument&) {
    }
  }
}

/// Sees images and adds them to a drive.
class DriveRecorder {
 public:
  /// `image_size`: of most images. `for_poses`: keeps features that are not pruned.
  DriveRecorder(std::shared_ptr<const LocalFeatureKind> kind, const LocalizerConfig& config, Pruning pruning,
                cv::Size image_size, bool for_poses)
      : kind_(std::move(kind)),
        config_(config),
        by_both_(config.prune && pruning == Pruning::kBoth),
        for_poses_(for_poses) {
    config_.prune = config.prune && pruning == Pruning::kPrevious;
    drive_.image_size = image_size;
  }

  void add(std::int64_t stamp_ns, const cv::Mat& grey, const std::optional<TruePose>& truth) {
    if (!front_end_) {
      MapHeader like_the_map;
      like_the_map.image_size = drive_.image_size;
      like_the_map.kind = kind_;
      front_end_.emplace(frontEndConfigOf(config_, like_the_map));
    }
    front_end_->setImage(stamp_ns, grey);
    const CpuStopwatch sift_watch;
    DriveImage image{stamp_ns, truth, front_end_->local(), {}, {}};
    drive_.sift_ms += sift_watch.elapsed_ms();
    const CpuStopwatch global_watch;
    image.global = front_end_->global();
    drive_.global_ms += global_watch.elapsed_ms();
    if (for_poses_ || by_both_) image.unpruned = front_end_->unprunedLocal();
    drive_.images.push_back(std::move(image));
  }

  Drive finish() {
    if (by_both_) {
      const CpuStopwatch sift_watch;
      pruneByBothNeighbours(drive_.images, config_.match.max_angle_ratio, kMaxImageGap_s);
      drive_.sift_ms += sift_watch.elapsed_ms();
    }
    if (!for_poses_) {
      for (DriveImage& image : drive_.images) image.unpruned.reset();
    }
    const auto count = static_cast<double>(std::max<std::size_t>(1, drive_.images.size()));
    drive_.sift_ms /= count;
    drive_.global_ms /= count;
    return std::move(drive_);
  }

 private:
  std::shared_ptr<const LocalFeatureKind> kind_;
  LocalizerConfig config_;
  bool by_both_;
  bool for_poses_;
  std::optional<FrontEnd> front_end_;
  Drive drive_;
};

}  // namespace

std::string besideBag(const std::string& bag, const std::string& file) {
  return (std::filesystem::path(bag).parent_path() / file).string();
}

Trajectory trueTrajectory(const BagReader& bag, const std::string& topic, const LocalFrame& frame) {
  std::vector<TrajectoryPoint> points;
  for (const Fix& fix : bag.fixes(topic)) {
    if (!hasPosition(fix)) continue;
    if (!points.empty() && fix.stamp_ns <= points.back().stamp_ns) continue;
    points.push_back({fix.stamp_ns, frame.toEastNorth(fix.position), 0.0});
  }
  if (points.empty()) throw BagError(bag.path() + ": topic " + topic + " holds no believable fix");
  return Trajectory(std::move(points));
}

std::shared_ptr<const TrainingMap> recordMap(const std::string& path, const RoundSpec& recording,
                                             const MapBuilderConfig& config) {
  const BagReader bag(path);
  MapBuilderConfig like_the_round = config;
  like_the_round.prune = config.prune && recording.pruning != Pruning::kNone;
  MapBuilder builder(like_the_round);
  const std::vector<Fix> fixes = bag.fixes(recording.fix_topic);
  const std::optional<CameraModel> camera = cameraOf(bag, recording);
  if (config.geometry.enabled && !camera) {
    throw BagError(path + ": the camera of " + recording.name + " is not calibrated (no " +
                   cameraInfoTopic(recording.image_topic) +
                   "): name its camera_info, or set geometry/enabled to false for places only");
  }
  try {
    builder.beginSession(recording.name, fixes, {camera, {}, {}, bag.images(recording.image_topic).usualSize()});
    forEachImage(bag, recording.image_topic, [&builder](std::int64_t stamp_ns, const cv::Mat& grey) {
      if (builder.wants(stamp_ns)) builder.addImage(stamp_ns, grey);
    });
    return builder.build();
  } catch (const BagError&) {
    throw;
  } catch (const CameraError& error) {
    throw BagError(path + ": " + recording.image_topic + ": " + error.what());
  } catch (const std::runtime_error& error) {
    throw BagError(path + ": " + recording.fix_topic + ": " + error.what());
  }
}

std::shared_ptr<const Drive> recordDrive(const std::string& path, const RoundSpec& recording,
                                         const MapBuilderConfig& map, const LocalizerConfig& front_end,
                                         bool for_poses) {
  const BagReader bag(path);
  const Truth truth = truthOf(bag, recording, map.trajectory);
  const std::optional<CameraModel> camera = for_poses ? cameraOf(bag, recording) : std::nullopt;
  const cv::Size size = halvedTo(map.max_megapixels, bag.images(recording.image_topic).usualSize());
  std::unique_ptr<LocalFeatureKind> kind = map.local.chosen().clone();
  kind->adopt(map.model);
  DriveRecorder recorder(std::move(kind), front_end, recording.pruning, size, for_poses);
  forEachImage(bag, recording.image_topic,
               [&](std::int64_t stamp_ns, const cv::Mat& grey) { recorder.add(stamp_ns, grey, truth(stamp_ns)); });
  auto drive = std::make_shared<Drive>(recorder.finish());
  if (drive->images.empty()) throw BagError(path + ": topic " + recording.image_topic + " holds no usable image");
  const bool judged = std::any_of(drive->images.begin(), drive->images.end(),
                                  [](const DriveImage& image) { return image.truth.has_value(); });
  if (!judged) throw BagError(path + ": no image has a true position on " + recording.truth_topic);
  try {
    if (camera) drive->camera = fittedTo(drive->image_size, *camera);
  } catch (const CameraError& error) {
    throw BagError(path + ": " + recording.image_topic + ": " + error.what());
  }
  return drive;
}

std::vector<std::optional<TruePose>> trueMapPoses(const std::string& path, const RoundSpec& recording,
                                                  const MapBuilderConfig& config, const TrainingMap& map) {
  if (recording.poses.empty() && recording.truth_topic == recording.fix_topic) return {};
  const BagReader bag(path);
  if (recording.poses.empty() && !bag.hasFixes(recording.truth_topic)) return {};
  const Truth truth = truthOf(bag, recording, config.trajectory);
  std::vector<std::optional<TruePose>> poses;
  for (std::size_t i = 0; i < map.size(); ++i) poses.push_back(truth(map.pose(i).stamp_ns));
  return poses;
}

}  // namespace visual_localization
