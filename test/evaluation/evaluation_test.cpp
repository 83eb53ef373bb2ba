#include <sstream>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "visual_localization/evaluation/error_statistics.h"
#include "visual_localization/evaluation/image_order.h"
#include "visual_localization/evaluation/track_csv.h"

namespace visual_localization {
namespace {

using ::testing::ElementsAre;

TEST(ImageOrder, WrapsAroundTheClosedRound) {
  EXPECT_THAT(imageOrder(5, 0, std::nullopt), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(imageOrder(5, 3, std::nullopt), ElementsAre(3, 4, 0, 1, 2));
}

TEST(ImageOrder, KidnappingJumpsAndGoesOnFromThere) {
  EXPECT_THAT(imageOrder(6, 0, Kidnapping{3, 0}), ElementsAre(0, 1, 2, 0, 1, 2));
  EXPECT_THAT(imageOrder(6, 4, Kidnapping{2, 5}), ElementsAre(4, 5, 5, 0, 1, 2));
}

TEST(ImageOrder, RefusesIndicesBeyondTheRound) {
  EXPECT_THROW(imageOrder(5, 5, std::nullopt), std::invalid_argument);
  EXPECT_THROW(imageOrder(5, 0, Kidnapping{5, 0}), std::invalid_argument);
  EXPECT_THROW(imageOrder(5, 0, Kidnapping{0, 9}), std::invalid_argument);
  EXPECT_TRUE(imageOrder(0, 0, std::nullopt).empty());
}

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
  std::istringstream header(trackCsvHeader());
  std::istringstream row(trackCsvRow(estimate));
  std::vector<std::string> columns;
  std::vector<std::string> fields;
  for (std::string cell; std::getline(header, cell, ',');) columns.push_back(cell);
  for (std::string cell; std::getline(row, cell, ',');) fields.push_back(cell);
  ASSERT_EQ(fields.size(), columns.size());
  EXPECT_EQ(columns.front(), "stamp");
  EXPECT_EQ(fields[0], "1226500000.123456789");
  EXPECT_EQ(std::stod(fields[1]), 1.0 / 3.0);
  EXPECT_EQ(std::stod(fields[2]), -2.0e-7);
  EXPECT_EQ(fields[6], "TRACKING");
  EXPECT_EQ(fields[8], "SIFT");
}

}  // namespace
}  // namespace visual_localization
