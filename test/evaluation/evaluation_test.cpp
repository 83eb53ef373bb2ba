#include <algorithm>

#include <gtest/gtest.h>

#include "base/text.h"
#include "evaluation/evaluator.h"
#include "evaluation/metrics.h"

namespace visual_localization {
namespace {

TEST(ErrorStatistics, KnownAnswers) {
  const ErrorStatistics odd = summarise({6.0, 1.0, 2.0});
  EXPECT_EQ(odd.count, 3u);
  EXPECT_DOUBLE_EQ(odd.mean_m, 3.0);
  EXPECT_DOUBLE_EQ(odd.median_m, 2.0);
  EXPECT_DOUBLE_EQ(odd.within_5m, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(summarise({4.0, 1.0, 2.0, 9.0}).median_m, 3.0);
  EXPECT_DOUBLE_EQ(summarise({5.0}).within_5m, 0.0);
}

TEST(ErrorStatistics, NothingGivesZeros) { EXPECT_EQ(summarise({}).count, 0u); }

TEST(TrackCsv, RowHasAFieldForEveryColumnAndReadsBackExactly) {
  Estimate estimate;
  estimate.stamp_ns = 1226500000123456789;
  estimate.pose.position_m = {1.0 / 3.0, -2.0e-7};
  estimate.state = LocalizationState::kTracking;
  const std::vector<std::string> columns = csvFields(trackCsvHeader());
  const std::vector<std::string> fields = csvFields(trackCsvRow(estimate));
  ASSERT_EQ(fields.size(), columns.size());
  EXPECT_EQ(columns.front(), "stamp");
  EXPECT_EQ(fields[0], "1226500000.123456789");
  EXPECT_EQ(std::stod(fields[1]), 1.0 / 3.0);
  EXPECT_EQ(std::stod(fields[2]), -2.0e-7);
  EXPECT_EQ(fields[6], "TRACKING");
  EXPECT_EQ(fields[8], "SIFT");
  EXPECT_EQ(columns[20], "off_map");
  EXPECT_EQ(fields[20], "") << "unknown";
  EXPECT_EQ(fields[21], "NOT_SURE_YET");
}

/// What a pose is off by on the earth, not only in relation to a map that may be wrong itself.
TEST(TrackCsv, SigmasHaveTheMapsErrorInThem) {
  Estimate estimate;
  estimate.metric = MetricPose();
  estimate.metric->covariance.diagonal().setConstant(0.01 * 0.01);
  estimate.metric->map_covariance.diagonal().setConstant(20.0 * 20.0);
  estimate.pose.covariance_m2.setIdentity();
  estimate.pose.covariance_m2 *= 400.0001;
  estimate.pose.yaw_variance_rad2 = 0.25;
  const std::vector<std::string> columns = csvFields(trackCsvHeader());
  const std::vector<std::string> fields = csvFields(trackCsvRow(estimate));
  const auto field = [&](const char* name) {
    const auto column = std::find(columns.begin(), columns.end(), name) - columns.begin();
    return std::stod(fields[static_cast<std::size_t>(column)]);
  };
  EXPECT_NEAR(field("sigma_m"), 20.0, 0.001);
  EXPECT_NEAR(field("sigma_yaw_rad"), 0.5, 1e-9);
}

}  // namespace
}  // namespace visual_localization
