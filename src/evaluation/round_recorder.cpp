#include "evaluation/round_recorder.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/time.h"
#include "visual_localization/features/front_end.h"

namespace visual_localization {
namespace {

using Truth = std::function<std::optional<GeodeticPoint>(std::int64_t stamp_ns)>;

/// True positions at any time. The topic that maps are made from is no better than a map: it is cleaned like one.
Truth truthOf(const BagReader& bag, const RoundSpec& recording, const TrajectoryCleanerConfig& config) {
  const std::vector<Fix> fixes = bag.fixes(recording.truth_topic);
  const auto first =
      std::find_if(fixes.begin(), fixes.end(), [](const Fix& fix) { return fix.has_fix && isValid(fix.position); });
  if (first == fixes.end())
    throw BagError(bag.path() + ": topic " + recording.truth_topic + " holds no believable fix");
  const GeodeticPoint datum{first->position.latitude_deg, first->position.longitude_deg, 0.0};
  const LocalFrame frame(datum);
  Trajectory trajectory = recording.truth_topic == recording.fix_topic
                              ? cleanTrajectory(fixes, frame, config).trajectory
                              : trueTrajectory(bag, recording.truth_topic, frame);
  return [frame, trajectory = std::move(trajectory)](std::int64_t stamp_ns) -> std::optional<GeodeticPoint> {
    const std::optional<TrajectoryPoint> point = trajectory.at(stamp_ns);
    if (!point) return std::nullopt;
    return frame.toGeodetic(point->position_m);
  };
}

/// The images of a recording with their stamps, without those that cannot be used.
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
  DriveRecorder(const SiftConfig& sift, const LocalizerConfig& config) : sift_(sift), config_(config) {}

  void add(std::int64_t stamp_ns, const cv::Mat& grey, const std::optional<GeodeticPoint>& truth) {
    if (!front_end_) {
      drive_.image_size = grey.size();
      MapHeader like_the_map;
      like_the_map.image_size = grey.size();
      like_the_map.sift = sift_;
      front_end_.emplace(frontEndConfigOf(config_, like_the_map));
    }
    front_end_->setImage(stamp_ns, grey);
    const CpuStopwatch sift_watch;
    DriveImage image{stamp_ns, truth, front_end_->sift(), {}};
    drive_.sift_ms += sift_watch.elapsed_ms();
    const CpuStopwatch global_watch;
    image.global = front_end_->global();
    drive_.global_ms += global_watch.elapsed_ms();
    drive_.images.push_back(std::move(image));
  }

  Drive finish() {
    const auto count = static_cast<double>(std::max<std::size_t>(1, drive_.images.size()));
    drive_.sift_ms /= count;
    drive_.global_ms /= count;
    return std::move(drive_);
  }

 private:
  SiftConfig sift_;
  LocalizerConfig config_;
  std::optional<FrontEnd> front_end_;
  Drive drive_;
};

}  // namespace

Trajectory trueTrajectory(const BagReader& bag, const std::string& topic, const LocalFrame& frame) {
  std::vector<TrajectoryPoint> points;
  for (const Fix& fix : bag.fixes(topic)) {
    if (!fix.has_fix || !isValid(fix.position)) continue;
    if (!points.empty() && fix.stamp_ns <= points.back().stamp_ns) continue;
    points.push_back({fix.stamp_ns, frame.toEastNorth(fix.position), 0.0});
  }
  if (points.empty()) throw BagError(bag.path() + ": topic " + topic + " holds no believable fix");
  return Trajectory(std::move(points));
}

std::shared_ptr<const TrainingMap> recordMap(const std::string& path, const RoundSpec& recording,
                                             const MapBuilderConfig& config) {
  const BagReader bag(path);
  MapBuilder builder(config);
  const std::vector<Fix> fixes = bag.fixes(recording.fix_topic);
  try {
    builder.beginSession(recording.name, fixes, {bag.camera(recording.image_topic), {}});
    forEachImage(bag, recording.image_topic, [&builder](std::int64_t stamp_ns, const cv::Mat& grey) {
      if (builder.wants(stamp_ns)) builder.addImage(stamp_ns, grey);
    });
    return builder.build();
  } catch (const BagError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw BagError(path + ": " + recording.fix_topic + ": " + error.what());
  }
}

std::shared_ptr<const Drive> recordDrive(const std::string& path, const RoundSpec& recording,
                                         const MapBuilderConfig& map, const LocalizerConfig& front_end) {
  const BagReader bag(path);
  const Truth truth = truthOf(bag, recording, map.trajectory);
  DriveRecorder recorder(map.sift, front_end);
  forEachImage(bag, recording.image_topic,
               [&](std::int64_t stamp_ns, const cv::Mat& grey) { recorder.add(stamp_ns, grey, truth(stamp_ns)); });
  auto drive = std::make_shared<Drive>(recorder.finish());
  if (drive->images.empty()) throw BagError(path + ": topic " + recording.image_topic + " holds no usable image");
  const bool judged = std::any_of(drive->images.begin(), drive->images.end(),
                                  [](const DriveImage& image) { return image.truth.has_value(); });
  if (!judged) throw BagError(path + ": no image has a true position on " + recording.truth_topic);
  return drive;
}

}  // namespace visual_localization
