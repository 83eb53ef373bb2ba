#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "test/localization/wall_street.h"
#include "test/support/allocation_counter.h"
#include "test/support/swarm_config.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

using test::kSecond;

class SteadyState : public test::WallStreet,
                    public ::testing::WithParamInterface<std::tuple<const char*, const char*>> {};

INSTANTIATE_TEST_SUITE_P(TrackersAndFeatures, SteadyState,
                         ::testing::Combine(::testing::Values("dpso", "dpso_multi", "pf_gaussian", "pf_linear"),
                                            ::testing::Values("sift", "global", "hybrid")),
                         [](const auto& instance) {
                           return std::string(std::get<0>(instance.param)) + "_" + std::get<1>(instance.param);
                         });

TEST_P(SteadyState, AnImageTakesNothingFromTheHeap) {
  LocalizerConfig config = test::swarmConfig();
  config.tracker = std::get<0>(GetParam());
  Localizer localizer(map(), config);
  std::vector<cv::Mat> views;
  for (int i = 0; i < 10; ++i) views.push_back(viewAt(10.0 + 0.3 * i));
  views[3].convertTo(views[3], CV_8U, 0.15, 30.0);  // its grey levels are spread
  std::int64_t stamp_ns = 0;
  const auto driveToAndFro = [&] {
    for (const cv::Mat& view : views) localizer.process(stamp_ns += kSecond, view);
    for (auto view = views.rbegin(); view != views.rend(); ++view) localizer.process(stamp_ns += kSecond, *view);
  };
  driveToAndFro();  // by SIFT, for which a hybrid may find room too late
  config.features = std::get<1>(GetParam());
  localizer.configure(config);
  for (int warming_up = 0; warming_up < 3; ++warming_up) driveToAndFro();
  const std::size_t before = test::allocations();
  driveToAndFro();
  EXPECT_EQ(test::allocations() - before, 0U);
  EXPECT_GT(before, 0U) << "nothing is counted";
}

}  // namespace
}  // namespace visual_localization
