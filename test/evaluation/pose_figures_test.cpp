#include <cmath>

#include <gtest/gtest.h>

#include "evaluation/metrics.h"
#include "evaluation/unit_result.h"

namespace visual_localization {
namespace {

StepRecord stepOf(LocalizationState state, float error_m, float heading_err_deg = std::nanf(""),
                  float nees = std::nanf("")) {
  StepRecord record;
  record.state = state;
  record.source = PoseSource::kMetric;
  record.error_m = error_m;
  record.heading_err_deg = heading_err_deg;
  record.nees = nees;
  return record;
}

TEST(PoseFigures, CountWhatIsWrongAmongAllImages) {
  PoseFigures figures;
  figures.add(stepOf(LocalizationState::kTracking, 0.9F));
  figures.add(stepOf(LocalizationState::kTracking, 1.1F));
  figures.add(stepOf(LocalizationState::kTracking, 5.1F));
  figures.add(stepOf(LocalizationState::kUncertain, 90.0F));
  EXPECT_DOUBLE_EQ(figures.wrong1mShare(), 0.5);
  EXPECT_DOUBLE_EQ(figures.wrong5mShare(), 0.25);
}

TEST(PoseFigures, ShareOfImagesWithAPoseFromLandmarks) {
  PoseFigures figures;
  figures.add(stepOf(LocalizationState::kTracking, 1.0F));
  StepRecord place = stepOf(LocalizationState::kTracking, 1.0F);
  place.source = PoseSource::kPlace;
  for (int i = 0; i < 3; ++i) figures.add(place);
  EXPECT_DOUBLE_EQ(figures.metricShare(), 0.25);
}

TEST(PoseFigures, RecallAsksForPositionAndHeading) {
  PoseFigures figures;
  figures.add(stepOf(LocalizationState::kTracking, 0.25F, 2.0F));
  figures.add(stepOf(LocalizationState::kTracking, 0.2F, 2.1F));
  figures.add(stepOf(LocalizationState::kTracking, 0.6F, 1.0F));
  figures.add(stepOf(LocalizationState::kRecovering, 40.0F, 0.0F));
  EXPECT_DOUBLE_EQ(figures.absolute.recall(0), 0.25);
  EXPECT_DOUBLE_EQ(figures.absolute.recall(1), 0.5);
  EXPECT_DOUBLE_EQ(figures.absolute.recall(2), 0.75);
  EXPECT_NEAR(figures.absolute.meanHeading_deg(), 5.1 / 4.0, 1e-6);
}

TEST(PoseFigures, TheEllipseHoldsWhatChiSquaredSays) {
  PoseFigures figures;
  figures.add(stepOf(LocalizationState::kTracking, 1.0F, 1.0F, 5.99F));
  figures.add(stepOf(LocalizationState::kTracking, 1.0F, 1.0F, 6.01F));
  figures.add(stepOf(LocalizationState::kRecovering, 1.0F, 1.0F));  // claims nothing
  EXPECT_DOUBLE_EQ(figures.absolute.insideShare(), 0.5);
  EXPECT_NEAR(figures.absolute.meanNees(), 6.0, 1e-6);
}

TEST(PoseFigures, LeaveOutWhatIsNotKnown) {
  PoseFigures figures;
  figures.add(stepOf(LocalizationState::kTracking, std::nanf(""), 1.0F, 1.0F));
  StepRecord without_states = stepOf(LocalizationState::kNoMap, 3.0F);
  without_states.source = PoseSource::kNone;
  figures.add(without_states);
  EXPECT_EQ(figures.images, 0U);
  EXPECT_EQ(figures.absolute.positions, 1U);
  EXPECT_TRUE(std::isnan(figures.metricShare()));
  EXPECT_TRUE(std::isnan(figures.wrong1mShare()));
  EXPECT_TRUE(std::isnan(figures.absolute.recall(0)));
  EXPECT_TRUE(std::isnan(figures.relative.meanPosition_m()));
}

TEST(PoseFigures, Add) {
  PoseFigures one;
  one.add(stepOf(LocalizationState::kTracking, 2.0F, 1.0F, 1.0F));
  StepRecord relative = stepOf(LocalizationState::kTracking, 0.0F, 3.0F, 3.0F);
  relative.relative = {0.5F, 4.0F, 8.0F};
  PoseFigures other;
  other.add(relative);
  one += other;
  EXPECT_DOUBLE_EQ(one.wrong1mShare(), 0.5);
  EXPECT_DOUBLE_EQ(one.absolute.meanPosition_m(), 1.0);
  EXPECT_DOUBLE_EQ(one.absolute.meanHeading_deg(), 2.0);
  EXPECT_DOUBLE_EQ(one.absolute.meanNees(), 2.0);
  EXPECT_DOUBLE_EQ(one.relative.meanPosition_m(), 0.5);
  EXPECT_DOUBLE_EQ(one.relative.recall(1), 1.0);
  EXPECT_DOUBLE_EQ(one.relative.insideShare(), 0.0);
}

TEST(PoseFigures, NinetyFivePercentOfTheErrorsAreBelow) {
  RunRecord run;
  for (int i = 0; i <= 20; ++i) {
    run.steps.push_back(stepOf(LocalizationState::kTracking, static_cast<float>(i)));
    run.steps.back().relative.position_m = 0.5F * static_cast<float>(i);
  }
  const UnitResult unit = summariseRuns({run}, {});
  EXPECT_DOUBLE_EQ(unit.p95_err_m, 19.0);
  EXPECT_DOUBLE_EQ(unit.p95_relative_err_m, 9.5);
  EXPECT_EQ(unit.poses.images, 21U);
}

}  // namespace
}  // namespace visual_localization
