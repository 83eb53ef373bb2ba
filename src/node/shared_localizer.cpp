#include "node/shared_localizer.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "base/text.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

/// A disc that does not touch the map leaves nothing to search. `what`: for the message.
void requireNear(const char* what, const Eigen::Vector2d& centre_m, double radius_m, const Area& area) {
  const Eigen::Vector2d nearest_m = centre_m.cwiseMax(area.min_m).cwiseMin(area.max_m);
  if ((nearest_m - centre_m).norm() <= radius_m) return;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << what << " lies outside the map, which covers x from " << area.min_m.x()
       << " to " << area.max_m.x() << " m and y from " << area.min_m.y() << " to " << area.max_m.y() << " m";
  throw std::invalid_argument(text.str());
}

constexpr std::size_t kCovarianceRow = 6;  ///< x, y, z and three rotations

void refuseUnless(bool condition, const std::string& reason) {
  if (!condition) throw std::invalid_argument(reason);
}

bool finite(const geometry_msgs::Pose& pose) {
  const auto& p = pose.position;
  const auto& q = pose.orientation;
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(q.x) && std::isfinite(q.y) &&
         std::isfinite(q.z) && std::isfinite(q.w);
}

}  // namespace

void SharedLocalizer::configure(const LocalizerConfig& config) {
  requireValid(config);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (localizer_) localizer_->configure(config);
  config_ = config;
}

LocalizerConfig SharedLocalizer::configuration() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return config_;
}

void SharedLocalizer::setMap(std::shared_ptr<const TrainingMap> map) {
  auto localizer = std::make_unique<Localizer>(map, configuration());  // without the lock: images go on meanwhile
  const std::lock_guard<std::mutex> lock(mutex_);
  localizer->configure(config_);  // it may have changed just now
  if (camera_) localizer->setCamera(*camera_);
  if (mount_) localizer->setMount(*mount_);
  if (!mask_.empty()) localizer->setMask(mask_);
  if (waiting_prior_) localizer->relocalize(*waiting_prior_);
  waiting_prior_.reset();
  // Old localizer and map end with this function, when the lock is free again.
  localizer_.swap(localizer);
  map_.swap(map);
  has_map_ = true;
}

void SharedLocalizer::setCamera(const CameraModel& camera) {
  const std::lock_guard<std::mutex> lock(mutex_);
  camera_ = camera;
  if (localizer_) localizer_->setCamera(camera);
}

void SharedLocalizer::setMount(const SensorMount& mount) {
  requireMount(mount);
  const std::lock_guard<std::mutex> lock(mutex_);
  mount_ = mount;
  if (localizer_) localizer_->setMount(mount);
}

void SharedLocalizer::setMask(const Mask& mask) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (localizer_) localizer_->setMask(mask);
  mask_ = mask;
}

std::shared_ptr<const TrainingMap> SharedLocalizer::map() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return map_;
}

std::optional<SharedLocalizer::Result> SharedLocalizer::process(std::int64_t stamp_ns, const cv::Mat& grey) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!localizer_) return std::nullopt;
  passOdometry();
  const Estimate estimate = localizer_->process(stamp_ns, grey);
  return Result{estimate,
                localizer_->particles(),
                localizer_->lastLocal(),
                config_.match,
                localizer_->lastLandmarks(),
                localizer_->camera(),
                localizer_->mount(),
                localizer_->mask(),
                map_};
}

void SharedLocalizer::addOdometry(const OdometryReading& reading) {
  constexpr std::size_t kMostWaiting = 1000;
  if (!reading.position_m.allFinite() || !std::isfinite(reading.yaw_rad)) {
    throw std::invalid_argument("its pose is not finite");
  }
  const std::lock_guard<std::mutex> lock(odometry_mutex_);
  odometry_.push_back(reading);
  if (odometry_.size() > kMostWaiting) odometry_.pop_front();
}

/// The localizer is locked.
void SharedLocalizer::passOdometry() {
  std::deque<OdometryReading> readings;
  {
    const std::lock_guard<std::mutex> lock(odometry_mutex_);
    readings.swap(odometry_);
  }
  for (const OdometryReading& reading : readings) localizer_->addOdometry(reading);
}

std::optional<LocalizationState> SharedLocalizer::doubt() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!localizer_) return std::nullopt;
  return localizer_->doubt();
}

bool SharedLocalizer::relocalizeAnywhere() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (localizer_) localizer_->relocalize();
  return localizer_ != nullptr;
}

bool SharedLocalizer::relocalizeAround(const Eigen::Vector2d& centre_m, double radius_m) {
  const Prior prior = around(centre_m, radius_m);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!localizer_) return false;
  if (radius_m == 0.0) throw std::invalid_argument("the radius must be above 0, in metres");
  requireNear("the disc", centre_m, radius_m, localizer_->map().area());
  localizer_->relocalize(prior);
  return true;
}

bool SharedLocalizer::relocalizeAt(const Guess& guess) {
  constexpr double kNear_m = 10.0;
  constexpr double kSigmas = 3.0;
  const Prior prior = normallyDistributed(guess.mean_m, guess.covariance_m2);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (localizer_) {
    const double radius_m = std::max(kNear_m, kSigmas * largerSigma(guess.covariance_m2));
    requireNear("the pose", guess.mean_m, radius_m, localizer_->map().area());
    localizer_->relocalize(prior);
  } else {
    waiting_prior_ = prior;
  }
  return localizer_ != nullptr;
}

SharedLocalizer::Guess guessFrom(const geometry_msgs::PoseWithCovarianceStamped& message,
                                 const std::string& global_frame) {
  const std::string& frame = message.header.frame_id;
  refuseUnless(frame == global_frame || frame == "/" + global_frame,
               "its frame is '" + oneLine(frame, 100) + "' instead of '" + global_frame + "'");
  refuseUnless(finite(message.pose.pose), "the pose is not finite");
  const auto& covariance = message.pose.covariance;
  refuseUnless(std::all_of(covariance.begin(), covariance.end(), [](double value) { return std::isfinite(value); }),
               "the covariance is not finite");

  SharedLocalizer::Guess guess;
  guess.mean_m = {message.pose.pose.position.x, message.pose.pose.position.y};
  guess.covariance_m2 << covariance[0], covariance[1], covariance[kCovarianceRow], covariance[kCovarianceRow + 1];
  return guess;
}

}  // namespace visual_localization
