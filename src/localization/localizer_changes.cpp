// What the localizer is told between two images.

#include <utility>

#include "localization/image_likelihood.h"
#include "localization/place_filter.h"
#include "localization/pose_verifier.h"
#include "localization/session_choice.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

/// What the map's images made of the same calibration, if they had it: one camera took them and the live ones.
CameraModel adjustedCamera(const MapHeader& map, const CameraModel& published) {
  for (const Session& session : map.sessions) {
    if (session.published && areAlike(*session.published, published)) return *session.camera;
  }
  return published;
}

}  // namespace

void Localizer::configure(const LocalizerConfig& config) {
  const LocalizerConfig before = std::exchange(config_, LocalizerConfig(requireValid(config)));
  image_->configure(frontEndConfig(), config_.similarity);
  if (config_.sweep_images != before.sweep_images || config_.proposals != before.proposals) {
    sweep_.configure(static_cast<std::size_t>(config_.sweep_images), config_.proposals == "vlad");
  }
  choice_.configure(config_.features, config_.hybrid);
  sessions_->configure(config_.choose_session);
  assessor_.configure(config_.state);
  verifier_->configure(config_.metric);
  odometry_.configure(config_.odometry);
  likelihood_->configure(config_);
  witness_->configure(config_.bayes);
  verifier_->predictor().useOdometry(odometry_, config_.odometry);
  configureTracker(before.tracker);
  last_.reset();
}

void Localizer::setCamera(const CameraModel& camera) {
  camera_ = adjustedCamera(map_->header(), camera.scaledTo(map_->header().image_size));
  verifier_->resetCamera();
  last_.reset();
}

void Localizer::setMount(const SensorMount& mount) {
  requireMount(mount);
  mount_ = mount;
  verifier_->reset();
  last_.reset();
}

void Localizer::setMask(const Mask& mask) {
  mask_ = mask.scaledTo(map_->header().image_size);
  image_->configure(frontEndConfig(), config_.similarity);
  last_.reset();
}

FrontEndConfig Localizer::frontEndConfig() const {
  FrontEndConfig config = frontEndConfigOf(config_, map_->header());
  config.mask = mask_;
  return config;
}

void Localizer::configureTracker(const std::string& tracker_before) {
  if (config_.tracker == tracker_before && tracker_->configure(config_)) return;
  auto successor = makeTracker(*map_, config_, static_cast<std::uint32_t>(config_.seed));
  successor->reset(drawnFrom(tracker_->particles()));
  tracker_ = std::move(successor);
}

void Localizer::relocalize() { relocalize(anywhere(map_->area())); }

void Localizer::relocalize(const Prior& prior) {
  tracker_->reset(prior);
  forgetEvidence();
}

void Localizer::forgetEvidence() {
  choice_.reset();
  witness_->reset();
  assessor_.reset();
  verifier_->reset();
  left_at_.reset();
  last_.reset();
}

}  // namespace visual_localization
