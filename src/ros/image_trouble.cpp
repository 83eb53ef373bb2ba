#include "visual_localization/ros/image_trouble.h"

#include <cmath>
#include <cstdio>

namespace visual_localization {
namespace {

// Where people begin to call an image dark, bright or dull; nothing is decided by them.
constexpr double kDark = 20.0;
constexpr double kBright = 235.0;
constexpr double kDull = 8.0;
constexpr double kStretched = 0.05;

const char* guessAt(const ImageLook& look) {
  if (look.mean_grey < kDark) return ": dark or covered?";
  if (look.mean_grey > kBright) return ": overexposed?";
  if (look.contrast < kDull) return ": fog, or something before the lens?";
  return ": blurred, or fewer than the image before showed as well?";
}

std::string brightness(const ImageLook& look) {
  char text[80];
  std::snprintf(text, sizeof text, "mean grey level %.0f of 255, contrast %.0f", look.mean_grey, look.contrast);
  return text + std::string(guessAt(look));
}

std::string features(const Estimate& estimate) {
  if (estimate.features != FeatureKind::kSift) return "Hardly anything in the image";
  const std::string kept = std::to_string(estimate.features_kept);
  if (estimate.features_kept == estimate.features_extracted) return kept + " features in the image";
  return kept + " of " + std::to_string(estimate.features_extracted) + " features in the image are of use";
}

bool looksBad(const ImageLook& look) {
  return look.mean_grey < kDark || look.mean_grey > kBright || look.contrast < kDull;
}

std::string stretched(const ImageLook& look) {
  char text[120];
  std::snprintf(text, sizeof text, "Images are of another shape than the map's, stretched by %.2f: another camera?",
                look.stretch > 1.0 ? look.stretch : 1.0 / look.stretch);
  return text;
}

}  // namespace

std::string imageTrouble(const Estimate& estimate) {
  if (estimate.frozen) {
    const std::string times = std::to_string(estimate.repeats + 1) + " times";
    const std::string sent = "The camera has sent the same image " + times;
    return looksBad(estimate.look) ? sent + ", " + brightness(estimate.look) : sent + ": frozen?";
  }
  if (estimate.state == LocalizationState::kTracking) return {};
  if (estimate.blind || looksBad(estimate.look)) return features(estimate) + ", " + brightness(estimate.look);
  if (std::abs(estimate.look.stretch - 1.0) > kStretched) return stretched(estimate.look);
  return {};
}

}  // namespace visual_localization
