#include "visual_localization/features/front_end.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "map/extraction_pool.h"
#include "test/localization/wall_street.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

using test::kSecond;

class FrontEndTest : public test::WallStreet {
 protected:
  static FrontEnd makeFrontEnd(bool prune = true) { return FrontEnd(configOf(prune)); }
  static FrontEndConfig configOf(bool prune = true) { return {{320, 240}, std::make_shared<Sift>(), {}, prune, 5.0}; }
};

TEST_F(FrontEndTest, OnlyAnImageThatFollowsIsPruned) {
  FrontEnd front_end = makeFrontEnd();
  double along_m = 10.0;
  const auto pruned = [&](std::int64_t stamp_ns) {
    front_end.setImage(stamp_ns, viewAt(along_m += 0.6));
    return front_end.local().size() < front_end.localExtracted();
  };
  EXPECT_FALSE(pruned(0)) << "the first image has none before it";
  EXPECT_TRUE(pruned(1 * kSecond));
  EXPECT_FALSE(pruned(7 * kSecond)) << "after a gap";
  EXPECT_TRUE(pruned(8 * kSecond));
  EXPECT_FALSE(pruned(8 * kSecond)) << "a stamp that stands still";
  EXPECT_FALSE(pruned(2 * kSecond)) << "a stamp that goes back";
  front_end.setImage(3 * kSecond, cv::Mat(240, 320, CV_8UC1, cv::Scalar(0)));
  EXPECT_FALSE(pruned(4 * kSecond)) << "the image before was black";
}

TEST_F(FrontEndTest, ExtractsOnlyWhatIsAskedFor) {
  FrontEnd front_end = makeFrontEnd();
  for (int i = 0; i < 3; ++i) {
    front_end.setImage(i * kSecond, viewAt(10.0 + i));
    EXPECT_EQ(front_end.global().wgoh, GlobalExtractor().extract(viewAt(10.0 + i)).wgoh);
    EXPECT_FALSE(front_end.localIfExtracted());
    EXPECT_EQ(front_end.localExtracted(), 0U);
  }
  const LocalFeatures& sift = front_end.local();
  ASSERT_TRUE(front_end.localIfExtracted());
  EXPECT_EQ(front_end.localIfExtracted()->bytes(), sift.bytes());
  EXPECT_GT(front_end.localExtracted(), sift.size());
  front_end.setImage(3 * kSecond, viewAt(13.0));
  EXPECT_FALSE(front_end.localIfExtracted()) << "a new image forgets the features of the last one";
  EXPECT_EQ(front_end.localExtracted(), 0U);
}

TEST_F(FrontEndTest, AfterGlobalFeaturesSiftIsPrunedByTheImageBeforeAllTheSame) {
  FrontEnd always = makeFrontEnd();
  FrontEnd switching = makeFrontEnd();
  for (int i = 0; i < 4; ++i) {
    always.setImage(i * kSecond, viewAt(10.0 + 0.5 * i));
    switching.setImage(i * kSecond, viewAt(10.0 + 0.5 * i));
    always.local();
    if (i < 3) switching.global();
  }
  EXPECT_EQ(switching.local().bytes(), always.local().bytes());
  EXPECT_LT(switching.local().size(), switching.localExtracted());
}

TEST_F(FrontEndTest, KeepsThePreviousImageWhenTheCamerasBufferIsUsedAgain) {
  FrontEnd own_buffers = makeFrontEnd();
  FrontEnd shared_buffer = makeFrontEnd();
  cv::Mat buffer;
  for (int i = 0; i < 3; ++i) {
    const cv::Mat view = viewAt(10.0 + 0.5 * i);
    view.copyTo(buffer);
    own_buffers.setImage(i * kSecond, view);
    shared_buffer.setImage(i * kSecond, buffer);
    buffer.setTo(0);
  }
  EXPECT_GT(own_buffers.local().size(), 50U);
  EXPECT_EQ(shared_buffer.local().bytes(), own_buffers.local().bytes());
  EXPECT_EQ(shared_buffer.global().wgii, own_buffers.global().wgii);
}

TEST_F(FrontEndTest, AnImageThatRepeatsTheOneBeforeIsThatOneSeenLonger) {
  FrontEnd front_end = makeFrontEnd();
  FrontEnd undisturbed = makeFrontEnd();
  for (FrontEnd* each : {&front_end, &undisturbed}) {
    each->setImage(0, viewAt(10.0));
    EXPECT_FALSE(each->isRepeated()) << "the first image";
    each->setImage(kSecond, viewAt(10.6));
    EXPECT_FALSE(each->isRepeated());
  }
  const LocalFeatures before = front_end.local();
  for (int i = 2; i < 4; ++i) {
    front_end.setImage(i * kSecond, viewAt(10.6));
    EXPECT_TRUE(front_end.isRepeated());
    EXPECT_EQ(front_end.local().bytes(), before.bytes()) << "not pruned by itself";
  }
  cv::Mat other_bit = viewAt(10.6);
  other_bit.at<std::uint8_t>(239, 319) ^= 1;
  for (FrontEnd* each : {&front_end, &undisturbed}) each->setImage(4 * kSecond, other_bit);
  EXPECT_FALSE(front_end.isRepeated());
  EXPECT_EQ(front_end.local().bytes(), undisturbed.local().bytes());
}

TEST_F(FrontEndTest, AnImageOfAnotherSizeIsARepetitionWhenItIsResizedToTheSame) {
  FrontEnd front_end = makeFrontEnd();
  cv::Mat large;
  cv::resize(viewAt(10.0), large, cv::Size(640, 480), 0, 0, cv::INTER_CUBIC);
  front_end.setImage(0, large);
  front_end.setImage(kSecond, large);
  EXPECT_TRUE(front_end.isRepeated());
  EXPECT_EQ(front_end.statistics().stretch, 1.0);
  front_end.setImage(2 * kSecond, large(cv::Rect(0, 60, 640, 360)));
  EXPECT_FALSE(front_end.isRepeated());
  EXPECT_NEAR(front_end.statistics().stretch, 4.0 / 3.0, 1e-9);
}

TEST_F(FrontEndTest, ADullImageShowsWhatABrightOneDoes) {
  FrontEnd front_end = makeFrontEnd();
  front_end.setImage(0, viewAt(10.0));
  const std::size_t bright = front_end.local().size();
  cv::Mat dull;
  viewAt(10.0).convertTo(dull, CV_8U, 0.15, 30.0);
  for (int i = 1; i < 3; ++i) {
    front_end.setImage(i * 100 * kSecond, dull);
    EXPECT_GT(static_cast<double>(front_end.local().size()), 0.8 * static_cast<double>(bright));
    EXPECT_LT(front_end.statistics().contrast, 15.0) << "as it was";
    EXPECT_EQ(front_end.isRepeated(), i == 2);
  }
}

TEST_F(FrontEndTest, ADullImageIsTheSameInTraining) {
  for (const double gain : {0.1, 0.2, 0.3, 1.0}) {
    cv::Mat dull;
    viewAt(10.0).convertTo(dull, CV_8U, gain, 20.0);
    FrontEnd front_end = makeFrontEnd();
    front_end.setImage(0, dull);
    ExtractionPool pool(Sift(), {}, 1);
    const std::vector<TrainingImage> training = pool.extract({RawImage{TrainingPose(), dull}});
    EXPECT_EQ(front_end.local().bytes(), training.front().local.bytes()) << gain;
    EXPECT_EQ(front_end.global().wgii, training.front().global.wgii) << gain;
  }
}

TEST_F(FrontEndTest, AnImageThatStaysIsPrunedAsTheNewParametersSay) {
  FrontEnd front_end = makeFrontEnd();
  for (int i = 0; i < 2; ++i) front_end.setImage(i * kSecond, viewAt(10.0 + 0.5 * i));
  const std::size_t pruned = front_end.local().size();
  EXPECT_LT(pruned, front_end.localExtracted());
  front_end.configure(configOf(false));
  front_end.setImage(2 * kSecond, viewAt(10.5));
  ASSERT_TRUE(front_end.isRepeated());
  EXPECT_EQ(front_end.local().size(), front_end.localExtracted());
}

TEST_F(FrontEndTest, NoiseIsNotSpread) {
  FrontEnd front_end = makeFrontEnd();
  front_end.setImage(0, noisy(cv::Mat(240, 320, CV_8UC1, cv::Scalar(20)), 1, 2.0));
  EXPECT_LT(front_end.local().size(), 10U);
}

TEST_F(FrontEndTest, SaysWhatTheImageIsLike) {
  FrontEnd front_end = makeFrontEnd();
  cv::Mat halves(240, 320, CV_8UC1, cv::Scalar(10));
  halves.colRange(0, 160).setTo(50);
  front_end.setImage(0, halves);
  EXPECT_DOUBLE_EQ(front_end.statistics().mean_grey, 30.0);
  EXPECT_DOUBLE_EQ(front_end.statistics().contrast, 20.0);
  front_end.setImage(kSecond, cv::Mat(240, 320, CV_8UC1, cv::Scalar(255)));
  EXPECT_DOUBLE_EQ(front_end.statistics().mean_grey, 255.0);
  EXPECT_DOUBLE_EQ(front_end.statistics().contrast, 0.0);
}

TEST_F(FrontEndTest, WithoutPruningAllFeaturesAreKept) {
  FrontEnd front_end = makeFrontEnd(false);
  for (int i = 0; i < 3; ++i) {
    front_end.setImage(i * kSecond, viewAt(10.0 + 0.5 * i));
    EXPECT_GT(front_end.local().size(), 50U);
    EXPECT_EQ(front_end.local().size(), front_end.localExtracted());
  }
}

TEST_F(FrontEndTest, BothKindsSeeTheImageInTheMapsSize) {
  FrontEnd front_end = makeFrontEnd();
  cv::Mat large;
  cv::resize(viewAt(10.0), large, cv::Size(640, 480), 0, 0, cv::INTER_CUBIC);
  cv::Mat small;
  cv::resize(large, small, cv::Size(320, 240), 0, 0, cv::INTER_AREA);
  front_end.setImage(0, large);
  EXPECT_EQ(front_end.global().wgoh, GlobalExtractor().extract(small).wgoh);
  EXPECT_EQ(front_end.local().bytes(), makeSiftExtractor(SiftConfig())->extract(small).bytes());
}

TEST_F(FrontEndTest, ARefusedImageChangesNothing) {
  FrontEnd front_end = makeFrontEnd();
  front_end.setImage(0, viewAt(10.0));
  front_end.setImage(kSecond, viewAt(10.5));
  const LocalFeatures before = front_end.local();
  EXPECT_THROW(front_end.setImage(2 * kSecond, cv::Mat(240, 320, CV_8UC3)), std::invalid_argument);
  EXPECT_EQ(front_end.local().bytes(), before.bytes());
  FrontEnd undisturbed = makeFrontEnd();
  undisturbed.setImage(kSecond, viewAt(10.5));
  for (FrontEnd* each : {&front_end, &undisturbed}) each->setImage(3 * kSecond, viewAt(11.0));
  EXPECT_EQ(front_end.local().bytes(), undisturbed.local().bytes());
}

TEST_F(FrontEndTest, TheTimeCountsWhatWasExtracted) {
  FrontEnd front_end = makeFrontEnd();
  front_end.setImage(0, viewAt(10.0));
  const double none_ms = front_end.extract_ms();
  front_end.global();
  const double global_ms = front_end.extract_ms();
  EXPECT_GT(global_ms, none_ms);
  front_end.global();
  EXPECT_EQ(front_end.extract_ms(), global_ms);
  front_end.local();
  const double both_ms = front_end.extract_ms();
  EXPECT_GT(both_ms, global_ms);
  front_end.local();
  EXPECT_EQ(front_end.extract_ms(), both_ms);
}

/// White but for the left half.
Mask rightHalf() {
  cv::Mat grey(240, 320, CV_8U, cv::Scalar(255));
  grey.colRange(0, 160).setTo(0);
  return Mask(grey);
}

TEST_F(FrontEndTest, FeaturesUnderTheMaskAreNotUsed) {
  FrontEndConfig config = configOf(false);
  FrontEnd all(config);
  config.mask = rightHalf();
  FrontEnd masked(config);
  all.setImage(0, viewAt(10.0));
  masked.setImage(0, viewAt(10.0));
  std::vector<std::size_t> right;
  for (std::size_t i = 0; i < all.local().size(); ++i) {
    if (std::lround(all.local().keypoints()[i].x_px) >= 160) right.push_back(i);
  }
  ASSERT_GT(right.size(), 10U);
  ASSERT_LT(right.size(), all.local().size());
  EXPECT_EQ(masked.local().bytes(), all.local().subset(right).bytes());
}

TEST_F(FrontEndTest, WhatTheMaskHidesChangesNothing) {
  FrontEndConfig config = configOf(false);
  config.mask = rightHalf();
  FrontEnd clean(config);
  FrontEnd dirty(config);
  cv::Mat image = viewAt(10.0);
  clean.setImage(0, image);
  image.colRange(0, 100).setTo(0);  // the robot's arm; what is described near the border of the mask stays
  dirty.setImage(0, image);
  EXPECT_EQ(clean.global().wgoh, dirty.global().wgoh);
  EXPECT_EQ(clean.global().wgii, dirty.global().wgii);
  EXPECT_EQ(clean.statistics().mean_grey, dirty.statistics().mean_grey);
}

TEST_F(FrontEndTest, AMapIsMadeUnderTheSameMask) {
  FrontEndConfig config = configOf(false);
  config.mask = rightHalf();
  FrontEnd live(config);
  live.setImage(0, viewAt(10.0));
  ExtractionPool pool(Sift(), {}, 1);
  const TrainingImage training = pool.extract({{{}, viewAt(10.0), rightHalf()}}).front();
  EXPECT_EQ(training.local.bytes(), live.local().bytes());
  EXPECT_EQ(training.global.wgoh, live.global().wgoh);
}

TEST_F(FrontEndTest, AnotherMaskHoldsFromTheNextImageOn) {
  FrontEnd front_end(configOf(false));
  FrontEndConfig config = configOf(false);
  config.mask = rightHalf();
  front_end.setImage(0, viewAt(10.0));
  const std::size_t all = front_end.local().size();
  front_end.configure(config);
  front_end.setImage(kSecond, viewAt(10.6));
  EXPECT_LT(front_end.local().size(), all);
  for (const Keypoint& keypoint : front_end.local().keypoints()) EXPECT_GE(keypoint.x_px, 159.0F);
}

}  // namespace
}  // namespace visual_localization
