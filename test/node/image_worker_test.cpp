#include "node/image_worker.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/node/small_map.h"

namespace visual_localization {
namespace {

using testing::HasSubstr;

cv::Mat smallNoise() {
  cv::Mat image(240, 320, CV_8UC1);
  cv::randu(image, 0, 255);
  return image;
}

ReceivedImage imageAt(double stamp_s, std::function<cv::Mat()> decode = smallNoise) {
  ReceivedImage image;
  image.header.stamp = ros::Time(stamp_s);
  image.decode = std::move(decode);
  return image;
}

/// Keeps what the worker hands on. Read it only once the images have ended.
class RecordedOutput : public ImageOutput {
 public:
  void publish(const LocalizedImage& image, const ImageCounts& counts) override {
    published.push_back(image);
    counts_at.push_back(counts);
    if (fails) throw std::runtime_error("no subscriber likes it");
  }
  void refused(const std::string& reason) override { refusals.push_back(reason); }
  void timeWentBack() override { ++times_back; }

  std::vector<LocalizedImage> published;
  std::vector<ImageCounts> counts_at;
  std::vector<std::string> refusals;
  int times_back = 0;
  bool fails = false;
};

class ImageWorkerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { ros::Time::init(); }

  void start() {
    localizer_.setMap(test::smallMap());
    worker_.start("/camera");
  }

  void show(ReceivedImage image) {
    worker_.push(std::move(image));
    waitUntilAllHaveEnded();
  }

  void waitUntilAllHaveEnded() {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (worker_.counts().ended() < worker_.counts().received) {
      ASSERT_LT(std::chrono::steady_clock::now(), deadline) << "an image is in no count";
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  /// When nothing more is published.
  ImageCounts finish() {
    worker_.stop();
    return worker_.counts();
  }

  SharedLocalizer localizer_{LocalizerConfig{}};
  RecordedOutput output_;
  std::vector<std::string> lines_;  ///< of the log, by the worker's thread
  ThrottledLog log_{[this](ThrottledLog::Severity, const std::string& text) { lines_.push_back(text); },
                    std::chrono::milliseconds(0)};
  ImageWorker worker_{localizer_, {&output_}, log_};
};

TEST_F(ImageWorkerTest, AnImageIsPublishedWithItsHeaderAndItsPixels) {
  start();
  const cv::Mat grey = smallNoise();
  ReceivedImage image = imageAt(5.0, [grey] { return grey; });
  image.header.frame_id = "left";
  show(image);
  EXPECT_EQ(finish().processed, 1U);
  ASSERT_EQ(output_.published.size(), 1U);
  const LocalizedImage& published = output_.published.front();
  EXPECT_EQ(published.header.frame_id, "left");
  EXPECT_EQ(published.header.stamp, ros::Time(5.0));
  EXPECT_TRUE(published.has_stamp);
  EXPECT_EQ(published.grey.data, grey.data);
  EXPECT_EQ(published.result.estimate.stamp_ns, 5'000'000'000);
  EXPECT_EQ(output_.counts_at.front().processed, 1U) << "the image itself is counted before it is published";
}

TEST_F(ImageWorkerTest, WithoutAStampTheTimeOfProcessingStandsIn) {
  start();
  const ros::Time before = ros::Time::now();
  show(imageAt(0.0));
  EXPECT_EQ(finish().processed, 1U);
  ASSERT_EQ(output_.published.size(), 1U);
  EXPECT_FALSE(output_.published.front().has_stamp);
  EXPECT_GE(output_.published.front().header.stamp, before);
  EXPECT_THAT(lines_, testing::Contains(HasSubstr("without a stamp")));
}

TEST_F(ImageWorkerTest, AnUnusableImageIsRefusedWithTheReason) {
  start();
  show(imageAt(1.0, []() -> cv::Mat { throw std::runtime_error("JPEG is cut off"); }));
  show(imageAt(2.0, [] { return cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(0)); }));
  show(imageAt(3.0));
  const ImageCounts counts = finish();
  EXPECT_EQ(counts.refused, 2U);
  EXPECT_EQ(counts.processed, 1U);
  ASSERT_EQ(output_.refusals.size(), 2U);
  EXPECT_EQ(output_.refusals.front(), "JPEG is cut off");
  EXPECT_EQ(output_.published.size(), 1U);
  EXPECT_THAT(lines_, testing::Contains("Image refused: JPEG is cut off"));
}

TEST_F(ImageWorkerTest, AStampInTheFutureIsRefusedAndMakesNoOtherImageLate) {
  start();
  const double now_s = ros::Time::now().toSec();
  show(imageAt(4294967295.0));
  show(imageAt(now_s + 100000.0));
  show(imageAt(now_s));
  show(imageAt(now_s + 1.0));
  const ImageCounts counts = finish();
  EXPECT_EQ(counts.refused, 2U);
  EXPECT_EQ(counts.processed, 2U);
  EXPECT_EQ(counts.late, 0U);
  EXPECT_THAT(output_.refusals.front(), HasSubstr("its stamp 4294967295.000000000 s is more than a day after"));
}

TEST_F(ImageWorkerTest, WithoutAMapImagesAreCountedAsSuch) {
  worker_.start("/camera");
  show(imageAt(1.0));
  show(imageAt(2.0));
  localizer_.setMap(test::smallMap());
  show(imageAt(1.5));  // the time of images without a map does not matter
  const ImageCounts counts = finish();
  EXPECT_EQ(counts.received, 3U);
  EXPECT_EQ(counts.without_map, 2U);
  EXPECT_EQ(counts.processed, 1U);
  EXPECT_EQ(counts.refused, 0U);
}

TEST_F(ImageWorkerTest, ALateImageIsLeftOutUnlessTimeWentBack) {
  start();
  show(imageAt(10.0));
  show(imageAt(4.0));
  EXPECT_EQ(output_.times_back, 0);
  show(imageAt(5.0));
  const ImageCounts counts = finish();
  EXPECT_EQ(counts.late, 1U);
  EXPECT_EQ(counts.processed, 2U);
  EXPECT_EQ(output_.times_back, 1);
  EXPECT_THAT(lines_, testing::IsSupersetOf(
                          {HasSubstr("6 s older than the newest one (/camera)"), HasSubstr("Time went back by 5 s")}));
}

TEST_F(ImageWorkerTest, WhatIsReplacedBeforeItsTurnIsDropped) {
  start();
  std::promise<void> begun;
  std::promise<void> released;
  const std::shared_future<void> release = released.get_future().share();
  worker_.push(imageAt(1.0, [&begun, release] {
    begun.set_value();
    release.wait();
    return smallNoise();
  }));
  begun.get_future().wait();
  for (const double stamp_s : {2.0, 3.0, 4.0}) worker_.push(imageAt(stamp_s));
  released.set_value();
  waitUntilAllHaveEnded();
  const ImageCounts counts = finish();
  EXPECT_EQ(counts.received, 4U);
  EXPECT_EQ(counts.dropped, 2U);
  EXPECT_EQ(counts.processed, 2U);
  ASSERT_EQ(output_.published.size(), 2U);
  EXPECT_EQ(output_.published.back().header.stamp, ros::Time(4.0));
}

TEST_F(ImageWorkerTest, AnImageThatCannotBePublishedIsNotRefusedAsWell) {
  start();
  output_.fails = true;
  show(imageAt(1.0));
  show(imageAt(2.0));
  const ImageCounts counts = finish();
  EXPECT_EQ(counts.processed, 2U);
  EXPECT_EQ(counts.refused, 0U);
  EXPECT_THAT(lines_, testing::Contains(HasSubstr("no subscriber likes it")));
}

/// From several threads, while another one looks at the counts.
TEST_F(ImageWorkerTest, EveryReceivedImageComesToOneEnd) {
  worker_.start("/camera");
  std::atomic<bool> done{false};
  std::thread observer([&] {
    while (!done) {
      const ImageCounts counts = worker_.counts();
      EXPECT_LE(counts.ended(), counts.received);
    }
  });
  const auto push = [this](int images, double first_s) {
    for (int i = 0; i < images; ++i) {
      if (i % 5 == 0) {
        worker_.push(imageAt(first_s + i, []() -> cv::Mat { throw std::runtime_error("broken"); }));
      } else {
        worker_.push(imageAt(first_s + i));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(i % 3));
    }
  };
  push(20, 1.0);
  localizer_.setMap(test::smallMap());
  std::thread other(push, 40, 1.0);
  push(40, 100.0);
  other.join();
  waitUntilAllHaveEnded();
  done = true;
  observer.join();
  const ImageCounts counts = finish();
  EXPECT_EQ(counts.received, 100U);
  EXPECT_EQ(counts.ended(), 100U);
  EXPECT_EQ(output_.refusals.size(), counts.refused);
  EXPECT_EQ(output_.published.size(), counts.processed);
}

TEST_F(ImageWorkerTest, StopsWithoutHavingStarted) {
  worker_.push(imageAt(1.0));
  EXPECT_EQ(finish().received, 1U);
}

}  // namespace
}  // namespace visual_localization
