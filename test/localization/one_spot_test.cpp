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

/// Of the quickest of some images.
double leastTime_ms(const std::shared_ptr<const TrainingMap>& map, const char* tracker) {
  LocalizerConfig config;
  config.tracker = tracker;
  Localizer localizer(map, config);
  cv::RNG random(1);
  double least_ms = 1e9;
  for (std::int64_t k = 1; k <= 5; ++k) {
    cv::Mat grey(240, 320, CV_8U);
    random.fill(grey, cv::RNG::UNIFORM, 0, 256);
    const CpuStopwatch watch;
    localizer.process(1'000'000'000'000'000 + k * 1'000'000'000, grey);
    least_ms = std::min(least_ms, watch.elapsed_ms());
  }
  return least_ms;
}

TEST(OneSpot, ManyImagesThereTakeNoLongerThanAlongAWay) {
  constexpr std::size_t kImages = 50'000;
  const auto spot = mapOfSteps(kImages, 1e-7);
  const auto way = mapOfSteps(kImages, 1.0);
  for (const char* tracker : {"bayes", "dpso", "pf_gaussian", "pf_linear"}) {
    const double way_ms = leastTime_ms(way, tracker);
    EXPECT_LT(leastTime_ms(spot, tracker), 3.0 * way_ms) << tracker << ", along a way " << way_ms << " ms";
  }
}

}  // namespace
}  // namespace visual_localization
