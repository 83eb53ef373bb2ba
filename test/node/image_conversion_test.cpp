#include "visual_localization/ros/image_conversion.h"

#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace visual_localization {
namespace {

sensor_msgs::Image image(const std::string& encoding, std::uint32_t bytes_per_pixel, std::uint8_t value) {
  sensor_msgs::Image message;
  message.width = 20;
  message.height = 10;
  message.encoding = encoding;
  message.step = message.width * bytes_per_pixel + 4;
  message.data.assign(message.step * message.height, value);
  return message;
}

sensor_msgs::CompressedImage compressed(const std::string& extension) {
  cv::Mat grey(48, 64, CV_8UC1);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(2 * x + 2 * y);
  }
  sensor_msgs::CompressedImage message;
  cv::imencode(extension, grey, message.data);
  return message;
}

TEST(ImageConversion, EveryEncodingBecomesGrey) {
  for (const char* name : {"mono8", "bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"}) {
    EXPECT_NEAR(toGrey(image(name, 1, 77)).at<std::uint8_t>(5, 5), 77, 1) << name;
  }
  for (const char* name : {"bgr8", "rgb8"}) EXPECT_EQ(toGrey(image(name, 3, 77)).at<std::uint8_t>(5, 5), 77) << name;
  for (const char* name : {"bgra8", "rgba8"}) EXPECT_EQ(toGrey(image(name, 4, 77)).at<std::uint8_t>(5, 5), 77) << name;
}

TEST(ImageConversion, SixteenBitsAreScaledByTheFullRange) {
  EXPECT_EQ(toGrey(image("mono16", 2, 77)).at<std::uint8_t>(0, 0), 77);
  EXPECT_EQ(toGrey(image("mono16", 2, 255)).at<std::uint8_t>(0, 0), 255);
}

TEST(ImageConversion, SixteenBitsMayComeWithTheHighByteFirst) {
  for (const bool bigendian : {false, true}) {
    sensor_msgs::Image message = image("mono16", 2, 10);
    message.is_bigendian = bigendian ? 1 : 0;
    for (std::size_t i = bigendian ? 0 : 1; i < message.data.size(); i += 2) message.data[i] = 200;
    const cv::Mat grey = toGrey(message);
    EXPECT_EQ(grey.type(), CV_8UC1);
    ASSERT_EQ(grey.size(), cv::Size(20, 10));
    EXPECT_EQ(cv::countNonZero(grey != 199), 0) << grey;  // (200 * 256 + 10) / 257 = 199.3
  }
}

TEST(ImageConversion, ResultIsGreyAndOwnsItsPixels) {
  cv::Mat grey;
  { grey = toGrey(image("rgb8", 3, 9)); }
  EXPECT_EQ(grey.type(), CV_8UC1);
  EXPECT_EQ(grey.size(), cv::Size(20, 10));
}

TEST(ImageConversion, RefusesImagesThatContradictThemselves) {
  EXPECT_THROW(toGrey(image("32FC1", 4, 0)), ImageError);
  EXPECT_THROW(toGrey(image("bad\nencoding", 1, 0)), ImageError);
  auto message = image("mono8", 1, 0);
  message.data.pop_back();
  EXPECT_THROW(toGrey(message), ImageError);
  message = image("mono8", 1, 0);
  message.step = 3;
  EXPECT_THROW(toGrey(message), ImageError);
  message = image("mono8", 1, 0);
  message.width = 0;
  EXPECT_THROW(toGrey(message), ImageError);
  message = image("mono8", 1, 0);
  message.width = message.height = message.step = 0xFFFFFFFFU;
  EXPECT_THROW(toGrey(message), ImageError);
}

TEST(ImageConversion, OnePixel) {
  for (const char* name : {"mono8", "bayer_rggb8"}) {
    sensor_msgs::Image message;
    message.width = message.height = message.step = 1;
    message.encoding = name;
    message.data = {7};
    try {
      EXPECT_EQ(toGrey(message).size(), cv::Size(1, 1));
    } catch (const ImageError&) {
    }
  }
}

TEST(ImageConversion, CompressedImages) {
  for (const char* extension : {".jpg", ".png"}) {
    const cv::Mat grey = toGrey(compressed(extension));
    EXPECT_EQ(grey.size(), cv::Size(64, 48));
    EXPECT_NEAR(grey.at<std::uint8_t>(20, 20), 80, 4);
  }
}

TEST(ImageConversion, EveryTruncatedJpegIsRefused) {
  const auto whole = compressed(".jpg");
  for (std::size_t length = 0; length < whole.data.size(); ++length) {
    auto message = whole;
    message.data.resize(length);
    EXPECT_THROW(toGrey(message), ImageError) << length;
  }
}

TEST(ImageConversion, OtherFormatsAndHugeSizesAreRefused) {
  EXPECT_THROW(toGrey(compressed(".bmp")), ImageError);
  auto message = compressed(".png");
  message.data[16] = 0x7F;
  EXPECT_THROW(toGrey(message), ImageError);
}

TEST(ImageConversion, DamagedImagesNeverCrash) {
  std::mt19937 random(1);
  for (const char* extension : {".jpg", ".png"}) {
    const auto whole = compressed(extension);
    for (int run = 0; run < 300; ++run) {
      auto message = whole;
      message.data[random() % message.data.size()] = static_cast<std::uint8_t>(random());
      try {
        EXPECT_FALSE(toGrey(message).empty());
      } catch (const ImageError&) {
      }
    }
  }
}

}  // namespace
}  // namespace visual_localization
