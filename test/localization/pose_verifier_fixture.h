#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "localization/pose_verifier.h"
#include "test/localization/street_map.h"
#include "test/support/fake_image.h"
#include "test/support/stamps.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/localization/scores.h"

namespace visual_localization::test {

/// Known by its features.
class SeenImage final : public FakeImage {
 public:
  SeenImage(const TrainingMap& map, LocalFeatures features) : map_(map), features_(std::move(features)) {}
  Score compare(FeatureKind, std::size_t i) override {
    return LocalSimilarity({}, {}).compare(features_, *map_.local(i));
  }
  const LocalFeatures* unprunedLocal() override { return &features_; }

 private:
  const TrainingMap& map_;
  LocalFeatures features_;
};

class PoseVerifierTest : public testing::Test {
 protected:
  /// After particles compared the image with these training images.
  std::optional<MetricPose> verify(double time_s, const LocalFeatures& features,
                                   const std::vector<std::size_t>& compared) {
    return verifyWith(street_.camera(), time_s, features, compared);
  }
  std::optional<MetricPose> verifyWith(const CameraModel& camera, double time_s, const LocalFeatures& features,
                                       const std::vector<std::size_t>& compared) {
    features_ = features;
    verifier_.startImage(static_cast<std::int64_t>(time_s * kSecond_ns), features_, camera);
    const auto pose = verifier_.nearPrediction();
    return pose ? pose : verifier_.nearOneOf(mostSimilar(compared));
  }
  std::vector<std::size_t> mostSimilar(const std::vector<std::size_t>& compared) {
    SeenImage image(street_.map(), features_);
    Scores scores(street_.map().size());
    scores.startImage(FeatureKind::kLocal,
                      [&image](FeatureKind kind, std::size_t i) { return image.compare(kind, i); });
    for (const std::size_t i : compared) scores[i];
    return scores.mostSimilar();
  }
  /// An image with all features from beside training image `i`.
  std::optional<MetricPose> verifyNear(double time_s, std::size_t i) {
    return verify(time_s, street_.seenFrom(street_.trueNear(i, kBeside_m)), {i - 1, i, i + 1});
  }
  /// An image with only some features: enough for a pose, not for its being confirmed.
  std::optional<MetricPose> seeSome(double time_s, std::size_t i) {
    return verify(time_s, street_.fewSeenFrom(street_.trueNear(i, kBeside_m), i, 30), {i - 1, i, i + 1});
  }
  /// Of the position, metres.
  double error_m(const MetricPose& pose, std::size_t i) const {
    return (pose.camera.position_m - street_.mappedNear(i, kBeside_m).position_m).norm();
  }

  const Eigen::Vector3d kBeside_m{0.3, -0.1, 0.4};
  StreetMap street_;
  LocalFeatures features_;  ///< of the last image
  SessionChoice sessions_{street_.map(), true};
  PoseVerifier verifier_{street_.map(), {}, sessions_};
};

}  // namespace visual_localization::test
