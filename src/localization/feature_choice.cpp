#include "visual_localization/localization/feature_choice.h"

#include <string>

namespace visual_localization {

void HybridConfig::declare(ParameterVisitor& visitor) {
  visitor.real(
      {"hybrid/sift_below", "m", "after SIFT, global features follow when the cloud's sigmas are below (d_SIFT)"},
      sift_below_m, 0.0, 10000.0);
  visitor.real({"hybrid/global_above", "m", "after global features, SIFT follows when a sigma is above (d_global)"},
               global_above_m, 0.0, 10000.0);
  visitor.integer(
      {"hybrid/sift_every", "1",
       "SIFT at least once in this number of images, and until an image confirms the position; 0: no such check"},
      sift_every, 0, 1000000);
}

FeatureChoice::FeatureChoice(const std::string& features, const HybridConfig& config)
    : hybrid_(features == "hybrid"),
      config_(config),
      first_(features == "global" ? FeatureKind::kGlobal : FeatureKind::kLocal),
      next_(first_) {}

void FeatureChoice::configure(const std::string& features, const HybridConfig& config) {
  FeatureChoice changed(features, config);
  if (changed.hybrid_ == hybrid_ && changed.first_ == first_) {
    changed.next_ = next_;
    changed.since_local_ = since_local_;
  }
  *this = changed;
}

void FeatureChoice::reset() {
  next_ = first_;
  since_local_ = 0;
}

void FeatureChoice::update(const Eigen::Vector2d& spread_m, bool confirmed, bool doubtful) {
  if (!hybrid_) return;
  since_local_ = next_ == FeatureKind::kLocal ? 0 : since_local_ + 1;
  if (isLocalDue(confirmed) || doubtful) {
    next_ = FeatureKind::kLocal;
    return;
  }
  const double largest_m = spread_m.maxCoeff();
  if (next_ == FeatureKind::kLocal && largest_m < config_.sift_below_m) {
    next_ = FeatureKind::kGlobal;
  } else if (next_ == FeatureKind::kGlobal && largest_m > config_.global_above_m) {
    next_ = FeatureKind::kLocal;
  }
}

bool FeatureChoice::isLocalDue(bool confirmed) const {
  if (config_.sift_every == 0) return false;
  return since_local_ + 1 >= config_.sift_every || (next_ == FeatureKind::kLocal && !confirmed);
}

}  // namespace visual_localization
