#include "visual_localization/ros/shared_localizer.h"

#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <utility>

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

}  // namespace

void SharedLocalizer::configure(const LocalizerConfig& config) {
  const auto wrong = config.violations();
  if (!wrong.empty()) throw ParameterError(wrong.front());
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

}  // namespace visual_localization
