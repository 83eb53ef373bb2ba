#include "features/picture_motion.h"

#include <gtest/gtest.h>

#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

TEST(PictureMotion, MeasuresHowFarThePictureMoves) {
  const cv::Mat wall = test::wall(1200, 240, 7);
  PictureMotion motion(2);
  std::int64_t stamp_ns = 0;
  for (const int left_px : {400, 432, 368, 368}) motion.add(stamp_ns += kSecond_ns, test::viewOf(wall, left_px));
  const std::vector<PictureShift> shifts = motion.finish();
  ASSERT_EQ(shifts.size(), 3U);
  EXPECT_NEAR(shifts[0].shift.x(), -0.1, 0.005) << "the camera moves right, the picture left";
  EXPECT_NEAR(shifts[1].shift.x(), 0.2, 0.005);
  EXPECT_NEAR(shifts[2].shift.x(), 0.0, 0.005);
  for (const PictureShift& shift : shifts) EXPECT_NEAR(shift.shift.y(), 0.0, 0.005);
  EXPECT_EQ(shifts[1].from_ns, 2 * kSecond_ns);
  EXPECT_EQ(shifts[1].to_ns, 3 * kSecond_ns);
}

TEST(PictureMotion, IsNoneBetweenImagesThatShowNothingInCommon) {
  PictureMotion motion(1);
  motion.add(0, test::viewOf(test::wall(400, 240, 1), 0));
  motion.add(kSecond_ns, cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  motion.add(2 * kSecond_ns, cv::Mat());
  const std::vector<PictureShift> shifts = motion.finish();
  ASSERT_EQ(shifts.size(), 1U) << "the last one is no image";
  EXPECT_EQ(shifts[0].shift, Eigen::Vector2d::Zero());
}

TEST(PictureMotion, TakesAtMostFourImagesASecond) {
  PictureMotion motion(1);
  EXPECT_TRUE(motion.wants(0));
  motion.add(0, cv::Mat());
  EXPECT_FALSE(motion.wants(kSecond_ns / 10));
  EXPECT_FALSE(motion.wants(-kSecond_ns)) << "out of order";
  EXPECT_TRUE(motion.wants(kSecond_ns / 4));
}

}  // namespace
}  // namespace visual_localization
