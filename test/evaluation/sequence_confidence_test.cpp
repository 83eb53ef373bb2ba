#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "evaluation/place_recogniser.h"
#include "test/evaluation/place_rows.h"

namespace visual_localization {
namespace {

TEST(SequenceConfidence, IsSureOfATwinPlaceOnlyAfterTheWayToIt) {
  std::vector<double> twins = test::rowAt(55, 80, false);
  for (std::size_t image = 0; image < 40; ++image) twins[image] = twins[image + 40];
  EXPECT_NEAR(SequenceMatcher({}, false).update(twins).confidence, 0.0, 1e-9);
  SequenceMatcher matcher({}, false);
  test::drive(matcher, 46, 9, 80, false);
  const Recognition answer = matcher.update(twins);
  EXPECT_EQ(answer.training_image, 55u);
  EXPECT_GT(answer.confidence, 0.5);
}

TEST(SequenceConfidence, ConfidenceStaysBetweenZeroAndOneAndIsZeroWithoutEvidenceOrRival) {
  SequenceMatcher matcher({}, true);
  EXPECT_EQ(matcher.update(std::vector<double>(80, 0.0)).confidence, 0.0);
  std::mt19937 generator(3);
  for (std::size_t at = 0; at < 40; ++at) {
    const double confidence = matcher.update(test::noisy(test::rowAt(at, 80, true), 0.3, generator)).confidence;
    EXPECT_GE(confidence, 0.0);
    EXPECT_LE(confidence, 1.0);
  }
  SequenceMatcher small({}, true);
  EXPECT_EQ(test::drive(small, 0, 5, 5, true).confidence, 0.0);
}

TEST(SequenceConfidence, TwoPerfectLinesAreNoCertainty) {
  for (int percent = 30; percent < 90; ++percent) {
    std::vector<double> row(80, 0.0);
    row[20] = 0.8;
    row[60] = 0.01 * percent;
    SequenceMatcher matcher({}, false);
    EXPECT_EQ(matcher.update(row).confidence, 0.0) << percent;
  }
}

TEST(SequenceConfidence, BeforeTheBeginningOfAnOpenRouteIsAverage) {
  std::vector<double> row(80, 0.0);
  row[0] = 0.8;
  SequenceMatcher matcher({}, false);
  matcher.update(std::vector<double>(80, 0.0));
  const Recognition answer = matcher.update(row);
  EXPECT_EQ(answer.training_image, 0u);
  // Contrast -sqrt(10) among 11, halved by the image before; the rival is average, the least contrast -sqrt(20).
  EXPECT_NEAR(answer.confidence, 0.5 / std::sqrt(2.0), 1e-12);
}

}  // namespace
}  // namespace visual_localization
