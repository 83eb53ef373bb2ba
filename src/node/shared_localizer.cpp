#include "node/shared_localizer.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <Eigen/LU>

#include "base/text.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

/// Particles stay in the map's area: a disc that does not touch it holds no place to search.
void requireOnMap(const Eigen::Vector2d& centre_m, double radius_m, const Area& area) {
  const Eigen::Vector2d nearest_m = centre_m.cwiseMax(area.min_m).cwiseMin(area.max_m);
  if ((nearest_m - centre_m).norm() <= radius_m) return;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "the disc lies off the map, which covers x from " << area.min_m.x()
       << " to " << area.max_m.x() << " m and y from " << area.min_m.y() << " to " << area.max_m.y() << " m";
  throw std::invalid_argument(text.str());
}

constexpr std::size_t kRow = 6;  ///< x, y, z and three rotations

void refuseUnless(bool condition, const std::string& reason) {
  if (!condition) throw std::invalid_argument(reason);
}

bool finite(const geometry_msgs::Pose& pose) {
  const auto& p = pose.position;
  const auto& q = pose.orientation;
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(q.x) && std::isfinite(q.y) &&
         std::isfinite(q.z) && std::isfinite(q.w);
}

/// Two symmetric 2 x 2 entries are equal up to rounding, trace and determinant not negative up to rounding.
void checkCovariance(const Eigen::Matrix2d& covariance) {
  const double scale = covariance.cwiseAbs().maxCoeff();
  refuseUnless(scale <= kLargestCoordinate_m * kLargestCoordinate_m, "the covariance is larger than any local map");
  refuseUnless(std::abs(covariance(0, 1) - covariance(1, 0)) <= 1e-9 * scale, "the covariance is not symmetric");
  refuseUnless(covariance(0, 0) >= 0.0 && covariance(1, 1) >= 0.0 && covariance.determinant() >= -1e-12 * scale * scale,
               "the covariance of x and y is not positive semi-definite");
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
  if (waiting_guess_) localizer->relocalize(normallyDistributed(waiting_guess_->mean_m, waiting_guess_->covariance_m2));
  waiting_guess_.reset();
  // The old localizer and map now end with this function, when the lock is free again.
  localizer_.swap(localizer);
  map_.swap(map);
  has_map_ = true;
}

std::shared_ptr<const TrainingMap> SharedLocalizer::map() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return map_;
}

std::optional<SharedLocalizer::Result> SharedLocalizer::process(std::int64_t stamp_ns, const cv::Mat& grey) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!localizer_) return std::nullopt;
  const Estimate estimate = localizer_->process(stamp_ns, grey);
  return Result{estimate, localizer_->particles(), localizer_->lastSift(), config_.match, map_};
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
  requireOnMap(centre_m, radius_m, localizer_->map().area());
  localizer_->relocalize(prior);
  return true;
}

bool SharedLocalizer::relocalizeAt(const Guess& guess) {
  const Prior prior = normallyDistributed(guess.mean_m, guess.covariance_m2);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (localizer_) {
    localizer_->relocalize(prior);
  } else {
    waiting_guess_ = guess;
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
  refuseUnless(guess.mean_m.cwiseAbs().maxCoeff() <= kLargestCoordinate_m, "the position is beyond any local map");
  guess.covariance_m2 << covariance[0], covariance[1], covariance[kRow], covariance[kRow + 1];
  checkCovariance(guess.covariance_m2);
  guess.covariance_m2 = 0.5 * (guess.covariance_m2 + guess.covariance_m2.transpose()).eval();
  return guess;
}

void requireDisc(const Eigen::Vector2d& centre_m, double radius_m) {
  refuseUnless(centre_m.allFinite() && centre_m.cwiseAbs().maxCoeff() <= kLargestCoordinate_m,
               "the centre is not a place on the map");
  refuseUnless(std::isfinite(radius_m) && radius_m > 0.0 && radius_m <= kLargestCoordinate_m,
               "the radius must be positive and no larger than a local map");
}

}  // namespace visual_localization
