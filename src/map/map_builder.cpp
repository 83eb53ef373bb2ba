#include "visual_localization/map/map_builder.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "visual_localization/features/pruning.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 2;  ///< Weiss et al., section III
constexpr int kSmallestSide_px = 16;
constexpr int kPreviewQuality = 70;

GeodeticPoint datumAt(const GeodeticPoint& position) {
  GeodeticPoint datum = position;
  if (!std::isfinite(datum.altitude_m)) datum.altitude_m = 0.0;
  return datum;
}

/// The middle of all valid fixes, axis by axis: unlike the first one it cannot be an outlier far away.
GeodeticPoint middleOf(const std::vector<Fix>& fixes) {
  std::vector<double> latitudes;
  std::vector<double> longitudes;
  for (const Fix& fix : fixes) {
    if (!fix.has_fix || !isValid(fix.position)) continue;
    latitudes.push_back(fix.position.latitude_deg);
    longitudes.push_back(fix.position.longitude_deg);
  }
  if (latitudes.empty()) throw std::runtime_error("none of its " + std::to_string(fixes.size()) + " fixes is valid");
  const auto middle = static_cast<std::ptrdiff_t>(latitudes.size() / 2);
  std::nth_element(latitudes.begin(), latitudes.begin() + middle, latitudes.end());
  std::nth_element(longitudes.begin(), longitudes.begin() + middle, longitudes.end());
  return {latitudes[latitudes.size() / 2], longitudes[longitudes.size() / 2], 0.0};
}

/// A frame around the first believable fix.
LocalFrame frameFor(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config) {
  const LocalFrame provisional(middleOf(fixes));
  const CleanedTrajectory cleaned = cleanTrajectory(fixes, provisional, config);
  const auto first = std::find(cleaned.verdicts.begin(), cleaned.verdicts.end(), FixVerdict::kKept);
  if (first == cleaned.verdicts.end()) throw std::runtime_error("none of its fixes is believable");
  return LocalFrame(datumAt(fixes[static_cast<std::size_t>(first - cleaned.verdicts.begin())].position));
}

bool isUsable(const cv::Mat& grey) {
  return grey.type() == CV_8UC1 && grey.rows >= kSmallestSide_px && grey.cols >= kSmallestSide_px;
}

cv::Mat resized(const cv::Mat& grey, cv::Size size) {
  if (grey.size() == size) return grey;
  cv::Mat result;
  cv::resize(grey, result, size, 0.0, 0.0, cv::INTER_AREA);
  return result;
}

std::vector<std::uint8_t> previewOf(const cv::Mat& grey, int width_px) {
  if (width_px <= 0) return {};
  const int height_px = std::max(1, static_cast<int>(std::lround(1.0 * grey.rows * width_px / grey.cols)));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", resized(grey, {width_px, height_px}), jpeg, {cv::IMWRITE_JPEG_QUALITY, kPreviewQuality});
  return jpeg;
}

/// The unpruned features of the images nearest to image `i`.
std::vector<const SiftFeatures*> neighboursOf(std::size_t i, const PositionIndex& index,
                                              const std::vector<TrainingImage>& images) {
  std::vector<const SiftFeatures*> neighbours;
  for (const Neighbour& neighbour : index.nearest(images[i].position_m, kNeighbours + 1)) {
    if (neighbour.image != i && neighbours.size() < kNeighbours) neighbours.push_back(&images[neighbour.image].sift);
  }
  return neighbours;
}

PositionIndex indexOf(const std::vector<TrainingImage>& images) {
  std::vector<Eigen::Vector2d> positions;
  for (const TrainingImage& image : images) positions.push_back(image.position_m);
  return PositionIndex(std::move(positions));
}

}  // namespace

void MapBuilderConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"map/min_spacing", "m", "skip an image closer than this to the last kept one of its round"},
               min_spacing_m, 0.0, 1000.0);
  visitor.flag({"map/prune", "", "keep only features that one of the two nearest training images shows as well"},
               prune);
  visitor.integer({"map/preview_width", "px", "width of the stored previews; 0 stores none"}, preview_width_px, 0, 640);
  sift.declare(visitor);
  match.declare(visitor);
  trajectory.declare(visitor);
}

std::vector<std::string> MapBuilderConfig::violations() const {
  std::vector<std::string> wrong = rangeViolations(*this);
  for (const auto& part : {sift.violations(), match.violations(), trajectory.violations()}) {
    wrong.insert(wrong.end(), part.begin(), part.end());
  }
  return wrong;
}

MapBuilder::MapBuilder(const MapBuilderConfig& config) : config_(config) {
  const std::vector<std::string> wrong = config_.violations();
  if (!wrong.empty()) throw ParameterError(wrong.front());
  sift_extractor_ = makeSiftExtractor(config_.sift);
  header_.sift = config_.sift;
}

MapBuilder::~MapBuilder() = default;

void MapBuilder::beginSession(const std::string& name, const std::vector<Fix>& fixes) {
  try {
    if (!frame_) frame_ = frameFor(fixes, config_.trajectory);
    report_.sessions.push_back(cleanTrajectory(fixes, *frame_, config_.trajectory));
  } catch (const std::exception& error) {
    throw std::runtime_error("session '" + name + "': " + error.what());
  }
  header_.datum = frame_->datum();
  header_.sessions.push_back(name);
  last_stamp_ns_.reset();
  last_kept_m_.reset();
}

bool MapBuilder::wants(std::int64_t stamp_ns) {
  if (report_.sessions.empty()) throw std::logic_error("map builder: image before the first session");
  if (last_stamp_ns_ && stamp_ns <= *last_stamp_ns_) {
    ++report_.images_disordered;
    return false;
  }
  last_stamp_ns_ = stamp_ns;
  const std::optional<TrajectoryPoint> place = report_.sessions.back().trajectory.at(stamp_ns);
  if (!place) {
    ++report_.images_without_position;
    return false;
  }
  if (last_kept_m_ && (place->position_m - *last_kept_m_).norm() < config_.min_spacing_m) {
    ++report_.images_too_close;
    return false;
  }
  return true;
}

void MapBuilder::addImage(std::int64_t stamp_ns, const cv::Mat& grey) {
  if (report_.sessions.empty()) throw std::logic_error("map builder: image before the first session");
  const std::optional<TrajectoryPoint> place = report_.sessions.back().trajectory.at(stamp_ns);
  if (!place || !isUsable(grey)) {
    ++(place ? report_.images_unusable : report_.images_without_position);
    return;
  }
  if (images_.empty()) header_.image_size = grey.size();
  const cv::Mat image_of_map_size = resized(grey, header_.image_size);

  TrainingImage image;
  image.stamp_ns = stamp_ns;
  image.session = static_cast<int>(header_.sessions.size()) - 1;
  image.position_m = place->position_m;
  image.yaw_rad = place->yaw_rad;
  image.sift = sift_extractor_->extract(image_of_map_size);
  image.global = global_extractor_.extract(image_of_map_size);
  image.preview_jpeg = previewOf(image_of_map_size, config_.preview_width_px);
  report_.features_extracted += image.sift.size();
  ++report_.images_kept;
  last_kept_m_ = image.position_m;
  images_.push_back(std::move(image));
}

std::shared_ptr<const TrainingMap> MapBuilder::build(const BuildProgress& progress) {
  if (images_.empty()) throw std::runtime_error("no image was kept, so there is no map");
  std::vector<TrainingImage> images = images_;
  const PositionIndex index = indexOf(images_);
  report_.features_kept = 0;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::vector<const SiftFeatures*> neighbours = neighboursOf(i, index, images_);
    // A map of one image has nothing to compare with: it keeps all its features.
    if (config_.prune && !neighbours.empty()) {
      images[i].sift = keepSeenIn(images_[i].sift, neighbours, config_.match.max_angle_ratio);
    }
    report_.features_kept += images[i].sift.size();
    if (progress) progress(i + 1, images.size());
  }
  return std::make_shared<const TrainingMap>(header_, std::move(images));
}

}  // namespace visual_localization
