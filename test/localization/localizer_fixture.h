#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/fake_image.h"
#include "test/support/stamps.h"
#include "test/support/swarm_config.h"
#include "test/support/synthetic.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization::test {

/// What a robot sees from a position: training images near it look alike.
class SeenFrom final : public FakeImage {
 public:
  explicit SeenFrom(std::shared_ptr<const TrainingMap> map) : map_(std::move(map)) {}

  bool isRepeated() const override { return repeated; }
  std::size_t localFeatures() override { return features; }
  ImageReport report() const override {
    ImageReport report;
    report.features_kept = features;
    return report;
  }
  void configure(const FrontEndConfig&, const SimilarityConfig& similarity) override {
    sift_recognised = similarity.sift_recognised;
  }
  Score compare(FeatureKind kind, std::size_t i) override {
    if (fails) throw std::runtime_error("a camera that fails");
    ++compared;
    const double width_m = kind == FeatureKind::kLocal ? 2.0 : 10.0;
    const double offset = (map_->position_m(i) - position_m).norm() / width_m;
    const double height = map_->pose(i).session == 0 ? best : best_of_others;
    const double similarity = height * std::exp(-0.5 * offset * offset);
    // It looks the larger the farther ahead it was taken.
    const double scale = std::exp(0.1 * (position_m - map_->position_m(i)).x());
    return {similarity, similarity, static_cast<std::size_t>(100.0 * similarity), similarity >= sift_recognised, scale};
  }

  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double best = 0.5;
  double best_of_others = 0.5;
  double sift_recognised = 0.05;
  bool repeated = false;
  bool fails = false;
  std::size_t features = 100;
  int compared = 0;

 private:
  std::shared_ptr<const TrainingMap> map_;
};

/// A street, driven twice.
inline std::shared_ptr<const TrainingMap> twoSessions() {
  MapHeader header;
  header.image_size = {320, 240};
  header.sessions = {{"first"}, {"second"}};
  std::vector<TrainingImage> images;
  for (int session = 0; session < 2; ++session) {
    for (int i = 0; i < 60; ++i) {
      TrainingImage image;
      image.stamp_ns = (i + 1000 * session) * kSecond_ns;
      image.session = session;
      image.position_m = {1.0 * i, 0.1 * session};
      images.push_back(image);
    }
  }
  return std::make_shared<const TrainingMap>(header, images);
}

/// A robot on a street of 60 m with a training image every metre.
class LocalizerTest : public testing::Test {
 protected:
  LocalizerTest() { make(swarmConfig()); }

  void make(const LocalizerConfig& config) { make(config, mapAt(street(60, 1.0))); }
  void make(const LocalizerConfig& config, std::shared_ptr<const TrainingMap> map) {
    config_ = config;
    image_ = std::make_shared<SeenFrom>(map);
    localizer_ = std::make_unique<Localizer>(map, config, image_);
    second_ = 0.0;
  }
  Estimate see(double x_m, double after_s = 1.0) {
    image_->position_m = {x_m, 0.0};
    second_ += after_s;
    return localizer_->process(static_cast<std::int64_t>(second_ * 1e9), cv::Mat());
  }
  /// A tracked position at 20 m.
  Estimate settle() {
    Estimate estimate;
    for (int i = 0; i < 40; ++i) estimate = see(20.0);
    EXPECT_EQ(estimate.state, LocalizationState::kTracking);
    return estimate;
  }

  LocalizerConfig config_;
  std::shared_ptr<SeenFrom> image_;
  std::unique_ptr<Localizer> localizer_;
  double second_ = 0.0;
};

}  // namespace visual_localization::test
