#include <algorithm>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "base/time.h"
#include "test/support/example_map.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

/// Images of one session, `step_m` apart; all look alike.
std::shared_ptr<const TrainingMap> mapOfSteps(std::size_t count, double step_m) {
  std::mt19937 random(1);
  MapHeader header = test::exampleHeader();
  header.sessions = {{"monday"}};
  TrainingImage image;
  image.local = test::randomFeatures(4, random);
  image.global.wgoh = image.global.wgii = test::randomHistogram(random);
  std::vector<TrainingImage> images(count, image);
  for (std::size_t i = 0; i < count; ++i) {
    images[i].stamp_ns = static_cast<std::int64_t>(i + 1) * 1'000'000'000;
    images[i].position_m = {step_m * static_cast<double>(i), 0.0};
  }
  return std::make_shared<const TrainingMap>(header, std::move(images));
}

void process(Localizer& localizer, std::int64_t stamp_s, const cv::Mat& grey, double& least_ms) {
  const CpuStopwatch watch;
  localizer.process(stamp_s * 1'000'000'000, grey);
  least_ms = std::min(least_ms, watch.elapsed_ms());
}

// By the quickest of some images, in turn: what else the machine does slows both.
TEST(OneSpot, ManyImagesThereTakeNoLongerThanAlongAWay) {
  constexpr std::size_t kImages = 50'000;
  const auto spot = mapOfSteps(kImages, 1e-7);
  const auto way = mapOfSteps(kImages, 1.0);
  for (const char* tracker : {"bayes", "dpso", "pf_gaussian", "pf_linear"}) {
    LocalizerConfig config;
    config.tracker = tracker;
    Localizer on_spot(spot, config);
    Localizer along_way(way, config);
    cv::RNG random(1);
    double spot_ms = 1e9;
    double way_ms = 1e9;
    for (std::int64_t k = 1; k <= 10; ++k) {
      cv::Mat grey(240, 320, CV_8U);
      random.fill(grey, cv::RNG::UNIFORM, 0, 256);
      process(on_spot, 1'000'000 + k, grey, spot_ms);
      process(along_way, 1'000'000 + k, grey, way_ms);
    }
    EXPECT_LT(spot_ms, 3.0 * way_ms) << tracker << ", along a way " << way_ms << " ms";
  }
}

}  // namespace
}  // namespace visual_localization
