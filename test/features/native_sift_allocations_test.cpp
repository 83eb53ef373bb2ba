#include <gtest/gtest.h>

#include "features/sift/native_sift_extractor.h"
#include "test/support/allocation_counter.h"
#include "test/support/synthetic.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

TEST(NativeSift, AllocatesNothingOnceItHasSeenSuchImages) {
  const cv::Mat wall = test::wall(400, 240, 9);
  const cv::Mat images[] = {test::viewOf(wall, 0), test::viewOf(wall, 40), test::viewOf(wall, 80)};
  NativeSiftExtractor extractor{SiftConfig()};
  LocalFeatures features;
  for (int round = 0; round < 2; ++round) {  // there are two sets of buffers: the result's and the next result's
    for (const cv::Mat& image : images) extractor.extract(image, features);
  }
  const std::size_t before = test::allocations();
  for (const cv::Mat& image : images) extractor.extract(image, features);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_FALSE(features.empty());
  EXPECT_GT(before, 0U);
}

}  // namespace
}  // namespace visual_localization
