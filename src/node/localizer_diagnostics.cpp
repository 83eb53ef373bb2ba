#include "node/localizer_diagnostics.h"

#include <cmath>
#include <cstdio>
#include <utility>

#include <diagnostic_msgs/DiagnosticStatus.h>

#include "base/numbers.h"

namespace visual_localization {
namespace {

// Only for the text: nothing is decided by these limits.
constexpr double kDark = 20.0;
constexpr double kBright = 235.0;
constexpr double kLowContrast = 8.0;
constexpr double kStretched = 0.05;

const char* guessAt(const ImageStatistics& image) {
  if (image.mean_grey < kDark) return ": dark or covered?";
  if (image.mean_grey > kBright) return ": overexposed?";
  if (image.contrast < kLowContrast) return ": fog, or a dirty lens?";
  return ": blurred, or little overlap with the previous image?";
}

std::string brightness(const ImageStatistics& image) {
  char text[80];
  std::snprintf(text, sizeof text, "mean grey level %.0f of 255, contrast %.0f", image.mean_grey, image.contrast);
  return text + std::string(guessAt(image));
}

std::string features(const Estimate& estimate) {
  if (estimate.evidence.features != FeatureKind::kLocal) return "Hardly any structure in the image";
  const std::string kept = std::to_string(estimate.image.features_kept);
  if (estimate.image.features_kept == estimate.image.features_extracted) return kept + " features in the image";
  return kept + " of " + std::to_string(estimate.image.features_extracted) +
         " features in the image left after pruning";
}

bool looksBad(const ImageStatistics& image) {
  return image.mean_grey < kDark || image.mean_grey > kBright || image.contrast < kLowContrast;
}

std::string stretched(const ImageStatistics& image) {
  char text[120];
  std::snprintf(text, sizeof text,
                "Aspect ratio of the images differs from the map's by a factor of %.2f: another camera?",
                image.stretch > 1.0 ? image.stretch : 1.0 / image.stretch);
  return text;
}

using diagnostic_msgs::DiagnosticStatus;

void addPose(const Estimate& estimate, diagnostic_updater::DiagnosticStatusWrapper& status) {
  status.add("Source of the pose", toString(estimate.source));
  status.addf("Sigma of position (m), heading (deg)", "%.2f, %.2f", estimate.sigma_m(),
              toDegrees(estimate.sigmaYaw_rad()));
  if (!estimate.evidence.verified) return;  // landmarks are not used
  status.add("Images since the last metric pose", estimate.images_since_metric);
  if (!estimate.metric) return;
  status.add("Inliers", estimate.metric->inliers);
  status.addf("Reprojection error (px)", "%.2f", estimate.metric->reprojection_px);
  status.addf("Sigma of the map: position (m), heading (deg)", "%.2f, %.2f", estimate.metric->mapSigma_m(),
              toDegrees(estimate.metric->mapSigmaYaw_rad()));
}

void addReason(const Estimate& estimate, diagnostic_updater::DiagnosticStatusWrapper& status) {
  status.add("Reason", textOf(estimate.why.reason).name);
  status.add("Advice", textOf(estimate.why.reason).advice);
  status.add("Unconfirmed images", estimate.unconfirmed);
  if (!estimate.threshold) return;
  status.addf("Probability around the pose, least that confirms", "%.3f, %.3f", *estimate.evidence.probability,
              *estimate.threshold);
  status.addf("Probability off the map", "%.3f", estimate.belief.off_map);
  const std::optional<PlaceBelief::Place>& rival = estimate.belief.rival;
  if (!rival) return;
  status.addf("Best other place: training image, x, y (m), probability", "%zu, %.1f, %.1f, %.3f", rival->training_image,
              rival->position_m.x(), rival->position_m.y(), rival->probability);
}

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

std::string imageTrouble(const Estimate& estimate) {
  if (estimate.frozen) {
    const std::string times = std::to_string(estimate.repeats + 1) + " times";
    const std::string sent = "The camera has sent the same image " + times;
    return looksBad(estimate.image.statistics) ? sent + ", " + brightness(estimate.image.statistics)
                                               : sent + ": frozen?";
  }
  if (estimate.state == LocalizationState::kTracking) return {};
  if (estimate.evidence.blind || looksBad(estimate.image.statistics))
    return features(estimate) + ", " + brightness(estimate.image.statistics);
  if (std::abs(estimate.image.statistics.stretch - 1.0) > kStretched) return stretched(estimate.image.statistics);
  return {};
}

LocalizerDiagnostics::LocalizerDiagnostics(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                                           const std::string& name, const NodeConfig& config,
                                           DescribeCamera describe_camera, CountImages count_images)
    : image_timeout_s_(config.image_timeout_s),
      describe_camera_(std::move(describe_camera)),
      count_images_(std::move(count_images)),
      updater_(node, private_node, name) {
  updater_.setHardwareID("none");
  updater_.add("localization", this, &LocalizerDiagnostics::reportState);
  updater_.add("images", this, &LocalizerDiagnostics::reportImages);
  updater_.add("map", this, &LocalizerDiagnostics::reportMap);
  updater_.add("camera", this, &LocalizerDiagnostics::reportCamera);
  if (config.tf_mode != "none") updater_.add("transform", this, &LocalizerDiagnostics::reportTransform);
}

void LocalizerDiagnostics::setImageTimeout(double image_timeout_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  image_timeout_s_ = image_timeout_s;
}

void LocalizerDiagnostics::imageArrived() {
  const std::lock_guard<std::mutex> lock(mutex_);
  arrivals_.add();
  last_arrival_ = Clock::now();
}

double LocalizerDiagnostics::age_s() const { return secondsSince(last_arrival_.value_or(start_)); }

std::optional<double> LocalizerDiagnostics::silence_s() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double silence = age_s();
  return silence > image_timeout_s_ ? std::optional<double>(silence) : std::nullopt;
}

void LocalizerDiagnostics::stateIs(LocalizationState state, const Why& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!estimate_) return;
  estimate_->state = state;
  estimate_->why = why;
}

void LocalizerDiagnostics::transformMissing(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  missing_transform_ = reason;
}

void LocalizerDiagnostics::imageProcessed(const Estimate& estimate, double latency_ms) {
  const std::lock_guard<std::mutex> lock(mutex_);
  estimate_ = estimate;
  latency_ms_ = latency_ms;
  last_refusal_.clear();
}

void LocalizerDiagnostics::imageRefused(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_refusal_ = reason;
}

void LocalizerDiagnostics::mapLoaded(const std::string& path, std::size_t images) {
  const std::lock_guard<std::mutex> lock(mutex_);
  map_path_ = path;
  map_images_ = images;
  estimate_.reset();
}

void LocalizerDiagnostics::cameraIs(const std::string& description, const std::string& trouble) {
  const std::lock_guard<std::mutex> lock(mutex_);
  camera_ = description;
  camera_trouble_ = trouble;
}

void LocalizerDiagnostics::reportState(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const LocalizationState state = estimate_         ? estimate_->state
                                  : map_images_ > 0 ? LocalizationState::kInitializing
                                                    : LocalizationState::kNoMap;
  const std::string why = estimate_ ? ": " + describe(estimate_->why) : "";
  status.summary(state == LocalizationState::kTracking ? DiagnosticStatus::OK : DiagnosticStatus::WARN,
                 toString(state) + why);
  if (!estimate_) return;
  addReason(*estimate_, status);
  addPose(*estimate_, status);
  status.add("Best similarity", estimate_->tracked.best.similarity);
  status.add("Matched features", estimate_->tracked.best.matches);
  status.addf("Median scale ratio", "%.2f", estimate_->tracked.best.scale);
  status.add("Features kept", estimate_->image.features_kept);
  if (!estimate_->threshold) status.addf("Place ratio", "%.3f", estimate_->evidence.place_ratio);
  status.addf("Motion residual (m)", "%.2f", estimate_->motion_residual_m);
  status.add("Training images compared", estimate_->comparisons);
  status.add("Training images compared by the map sweep", estimate_->swept);
  status.addf("Extract, match, update (ms)", "%.1f, %.1f, %.1f", estimate_->image.extract_ms, estimate_->image.match_ms,
              estimate_->update_ms);
}

void LocalizerDiagnostics::reportImages(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (age_s() > image_timeout_s_) {
    status.summaryf(DiagnosticStatus::ERROR, "No image for %.1f s on %s", age_s(), describe_camera_().c_str());
  } else if (!last_arrival_) {
    status.summary(DiagnosticStatus::WARN, "No image yet on " + describe_camera_());
  } else if (!last_refusal_.empty()) {
    status.summary(DiagnosticStatus::WARN, "Refused: " + last_refusal_);
  } else if (const std::string trouble = estimate_ ? imageTrouble(*estimate_) : ""; !trouble.empty()) {
    status.summary(DiagnosticStatus::WARN, trouble);
  } else {
    status.summary(DiagnosticStatus::OK, "Images arrive");
  }
  status.addf("Rate (Hz)", "%.2f", arrivals_.rate_hz());
  if (last_arrival_) status.addf("Age of the newest image (s)", "%.2f", age_s());
  if (latency_ms_ >= 0.0) status.addf("Latency (ms)", "%.1f", latency_ms_);
  const ImageCounts counts = count_images_();
  status.add("Received", counts.received);
  status.add("Processed", counts.processed);
  status.add("Dropped", counts.dropped);
  status.add("Late", counts.late);
  status.add("Refused", counts.refused);
  status.add("Without a map", counts.without_map);
  if (!estimate_) return;
  status.addf("Mean grey level, contrast (of 255)", "%.0f, %.0f", estimate_->image.statistics.mean_grey,
              estimate_->image.statistics.contrast);
  status.add("Repeats of the last image", estimate_->repeats);
}

void LocalizerDiagnostics::reportTransform(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool missing = !missing_transform_.empty();
  status.summary(missing ? DiagnosticStatus::WARN : DiagnosticStatus::OK,
                 missing ? "No transform broadcast: " + missing_transform_ : "Transform broadcast");
}

void LocalizerDiagnostics::reportCamera(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::string contradiction = estimate_ ? estimate_->cameraTrouble() : "";
  if (!camera_trouble_.empty()) {
    status.summary(DiagnosticStatus::WARN, "Calibration refused: " + camera_trouble_);
  } else if (!contradiction.empty()) {
    status.summary(DiagnosticStatus::WARN, "Calibration wrong: " + contradiction);
  } else {
    status.summary(DiagnosticStatus::OK, camera_);
  }
  status.add("In use", camera_);
  if (estimate_) status.addf("Focal length by the images (share)", "%.4f", estimate_->focal_scale);
}

void LocalizerDiagnostics::reportMap(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (map_images_ == 0) {
    status.summary(DiagnosticStatus::WARN, "No map is loaded");
    return;
  }
  status.summary(DiagnosticStatus::OK, "Map is loaded");
  status.add("Path", map_path_);
  status.add("Training images", map_images_);
}

}  // namespace visual_localization
