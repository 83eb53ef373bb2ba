#include "visual_localization/ros/image_conversion.h"

#include <algorithm>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <cv_bridge/cv_bridge.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sys/resource.h>
#include <zlib.h>

#include "test/support/refusal.h"

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

std::vector<std::uint8_t> bigEndian(std::size_t value, int count) {
  std::vector<std::uint8_t> bytes;
  for (int i = count - 1; i >= 0; --i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  return bytes;
}

void insert(std::vector<std::uint8_t>& data, std::size_t at, const std::vector<std::uint8_t>& what) {
  data.insert(data.begin() + static_cast<std::ptrdiff_t>(at), what.begin(), what.end());
}

TEST(ImageConversion, EveryEncodingBecomesGrey) {
  for (const char* name : {"mono8", "bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"}) {
    EXPECT_NEAR(toGrey(image(name, 1, 77)).at<std::uint8_t>(5, 5), 77, 1) << name;
  }
  for (const char* name : {"bgr8", "rgb8"}) EXPECT_EQ(toGrey(image(name, 3, 77)).at<std::uint8_t>(5, 5), 77) << name;
  for (const char* name : {"bgra8", "rgba8"}) EXPECT_EQ(toGrey(image(name, 4, 77)).at<std::uint8_t>(5, 5), 77) << name;
}

sensor_msgs::Image noiseOf(const std::string& encoding, int bytes_per_pixel, std::uint64_t seed) {
  sensor_msgs::Image message = image(encoding, static_cast<std::uint32_t>(bytes_per_pixel), 0);
  cv::RNG random(seed);
  for (std::uint8_t& byte : message.data) byte = static_cast<std::uint8_t>(random.uniform(0, 256));
  return message;
}

TEST(ImageConversion, EveryEncodingIsConvertedAsByCvBridge) {
  for (const auto& [name, bytes] : std::vector<std::pair<const char*, int>>{{"mono8", 1},
                                                                            {"bgr8", 3},
                                                                            {"rgb8", 3},
                                                                            {"bgra8", 4},
                                                                            {"rgba8", 4},
                                                                            {"bayer_rggb8", 1},
                                                                            {"bayer_bggr8", 1},
                                                                            {"bayer_gbrg8", 1},
                                                                            {"bayer_grbg8", 1},
                                                                            {"yuv422", 2},
                                                                            {"mono16", 2},
                                                                            {"bgr16", 6},
                                                                            {"rgb16", 6},
                                                                            {"bgra16", 8},
                                                                            {"rgba16", 8}}) {
    const sensor_msgs::Image message = noiseOf(name, bytes, 3);  // it uses the full range
    const cv::Mat expected = cv_bridge::toCvCopy(message, "mono8")->image;
    EXPECT_EQ(cv::norm(toGrey(message), expected, cv::NORM_INF), 0.0) << name;
  }
}

TEST(ImageConversion, OtherNamesOfTheSamePixelsGiveTheSame) {
  for (const auto& [name, known, bytes] :
       std::vector<std::tuple<const char*, const char*, int>>{{"8UC1", "mono8", 1},
                                                              {"8UC3", "bgr8", 3},
                                                              {"8UC4", "bgra8", 4},
                                                              {"16UC1", "mono16", 2},
                                                              {"16UC3", "bgr16", 6},
                                                              {"uyvy", "yuv422", 2},
                                                              {"yuyv", "yuv422_yuy2", 2}}) {
    const sensor_msgs::Image message = noiseOf(name, bytes, 4);
    sensor_msgs::Image same = message;
    same.encoding = known;
    EXPECT_EQ(cv::norm(toGrey(message), toGrey(same), cv::NORM_INF), 0.0) << name;
  }
}

TEST(ImageConversion, TheLuminanceOfYuvIsTheGreyImage) {
  for (const char* name : {"yuv422", "yuv422_yuy2"}) {
    sensor_msgs::Image message = image(name, 2, 128);
    const std::size_t first = name == std::string("yuv422") ? 1 : 0;
    for (std::size_t at = first; at < message.data.size(); at += 2) message.data[at] = 200;
    EXPECT_EQ(cv::countNonZero(toGrey(message) != 200), 0) << name;
  }
}

TEST(ImageConversion, BayerOfSixteenBitsIsTheOneOfEight) {
  for (const char* pattern : {"rggb", "bggr", "gbrg", "grbg"}) {
    const std::string name = std::string("bayer_") + pattern;
    const sensor_msgs::Image eight = noiseOf(name + "8", 1, 5);
    sensor_msgs::Image sixteen = image(name + "16", 2, 0);
    for (std::size_t row = 0; row < eight.height; ++row) {
      for (std::size_t column = 0; column < eight.width; ++column) {
        const std::uint8_t value = eight.data[row * eight.step + column];
        sixteen.data[row * sixteen.step + 2 * column] = value;
        sixteen.data[row * sixteen.step + 2 * column + 1] = value;
      }
    }
    EXPECT_LE(cv::norm(toGrey(sixteen), toGrey(eight), cv::NORM_INF), 1.0) << pattern;
  }
}

cv::Mat rampOf(int bits) {
  cv::Mat ramp(48, 64, CV_16UC1);
  const int full = (1 << bits) - 1;
  for (int x = 0; x < ramp.cols; ++x) ramp.col(x).setTo(full * x / (ramp.cols - 1));
  return ramp;
}

TEST(ImageConversion, SixteenBitsOfACameraOfLessAreScaledByItsOwn) {
  for (const char* kind : {"mono16", "16UC1", "png"}) {
    const auto grey = [kind](const cv::Mat& pixels) {
      if (std::string(kind) != "png") {
        return toGrey(*cv_bridge::CvImage({}, kind, pixels).toImageMsg());
      }
      sensor_msgs::CompressedImage message;
      cv::imencode(".png", pixels, message.data);
      return toGrey(message);
    };
    const cv::Mat expected = grey(rampOf(16));
    EXPECT_EQ(expected.at<std::uint8_t>(0, 63), 255);
    for (const int bits : {10, 12, 14}) {
      EXPECT_LE(cv::norm(grey(rampOf(bits)), expected, cv::NORM_INF), 1.0) << kind << " " << bits;
    }
    const cv::Mat dark = rampOf(12) / 8;  // up to 512: ten bits would hold it
    EXPECT_EQ(grey(dark).at<std::uint8_t>(0, 63), 128) << kind;
    EXPECT_EQ(cv::countNonZero(grey(cv::Mat::zeros(10, 10, CV_16UC1))), 0) << kind;
  }
}

TEST(ImageConversion, ColoursOfACameraOfLessBitsAreScaledByItsOwn) {
  const auto png = [](const cv::Mat& pixels) {
    sensor_msgs::CompressedImage message;
    cv::imencode(".png", pixels, message.data);
    return toGrey(message);
  };
  for (const int channels : {3, 4}) {
    const auto colours = [channels](int bits) {
      cv::Mat mixed;
      cv::merge(std::vector<cv::Mat>(static_cast<std::size_t>(channels), rampOf(bits)), mixed);
      return mixed;
    };
    const cv::Mat expected = png(colours(16));
    EXPECT_GE(expected.at<std::uint8_t>(0, 63), 254);
    for (const int bits : {10, 12, 14}) {
      EXPECT_LE(cv::norm(png(colours(bits)), expected, cv::NORM_INF), 1.0) << channels << " " << bits;
      const char* name = channels == 3 ? "bgr16" : "bgra16";
      const cv::Mat raw = toGrey(*cv_bridge::CvImage({}, name, colours(bits)).toImageMsg());
      EXPECT_LE(cv::norm(raw, expected, cv::NORM_INF), 1.0) << name << " " << bits;
    }
  }
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

TEST(ImageConversion, AStepOfZeroMeansNothingBetweenTheRows) {
  for (const char* name : {"mono8", "mono16"}) {
    sensor_msgs::Image message = image(name, name == std::string("mono8") ? 1 : 2, 77);
    for (const bool bigendian : {false, true}) {
      message.step = 0;
      message.is_bigendian = bigendian ? 1 : 0;
      EXPECT_NE(test::refusalOf<ImageError>([&] { toGrey(message); }), "accepted") << "more bytes than pixels";
    }
    message.data.resize(std::size_t{message.width} * message.height * (name == std::string("mono8") ? 1 : 2));
    for (const bool bigendian : {false, true}) {
      message.is_bigendian = bigendian ? 1 : 0;
      EXPECT_EQ(toGrey(message).at<std::uint8_t>(9, 19), 77) << name;
    }
  }
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

TEST(ImageConversion, WhatStandsBehindTheEndOfAnImageDoesNotMatter) {
  const std::vector<std::uint8_t> line_ends{'\r', '\n', '-', '-', 'b', '\r', '\n'};
  for (const char* extension : {".jpg", ".png"}) {
    const auto whole = compressed(extension);
    for (const std::vector<std::uint8_t>& behind :
         {line_ends, std::vector<std::uint8_t>(5000, 0), std::vector<std::uint8_t>(5000, 0xFF), whole.data}) {
      auto message = whole;
      insert(message.data, message.data.size(), behind);
      EXPECT_EQ(cv::norm(toGrey(message), toGrey(whole), cv::NORM_INF), 0.0) << extension << " " << behind.size();
    }
  }
}

// As of a Logitech C270 (opencv/opencv#9477): "extraneous bytes before marker".
TEST(ImageConversion, StrayBytesBeforeMarkersDoNotMatter) {
  const cv::Mat pixels = toGrey(compressed(".png"));
  sensor_msgs::CompressedImage whole;
  cv::imencode(".jpg", pixels, whole.data, {cv::IMWRITE_JPEG_RST_INTERVAL, 1});
  std::size_t stray = 0;
  sensor_msgs::CompressedImage message;
  for (std::size_t i = 0; i < whole.data.size(); ++i) {
    const bool marker = whole.data[i] == 0xFF && i + 1 < whole.data.size() && whole.data[i + 1] >= 0xD0 &&
                        whole.data[i + 1] <= 0xD9 && whole.data[i + 1] != 0xD8;
    if (marker) insert(message.data, message.data.size(), std::vector<std::uint8_t>(1 + stray++ % 7, 0x5A));
    message.data.push_back(whole.data[i]);
  }
  ASSERT_GT(stray, 2U);
  EXPECT_EQ(cv::norm(toGrey(message), toGrey(whole), cv::NORM_INF), 0.0);
}

// Drivers write "jpeg", "jpg", "bgra8; jpeg compressed bgr8" or nothing (microsoft/Azure_Kinect_ROS_Driver#146).
TEST(ImageConversion, TheNameOfACompressedFormatDoesNotMatter) {
  for (const char* extension : {".jpg", ".png"}) {
    const cv::Mat expected = toGrey(compressed(extension));
    for (const char* format : {"", "jpeg", "png", "bgra8; jpeg compressed bgr8", "mono8; png compressed ", "h264"}) {
      sensor_msgs::CompressedImage message = compressed(extension);
      message.format = format;
      EXPECT_EQ(cv::norm(toGrey(message), expected, cv::NORM_INF), 0.0) << extension << " " << format;
    }
  }
}

TEST(ImageConversion, EveryKindOfJpegIsDecodedAsByOpenCv) {
  cv::Mat colour(61, 83, CV_8UC3);
  cv::randu(colour, 0, 256);
  cv::Mat grey;
  cv::cvtColor(colour, grey, cv::COLOR_BGR2GRAY);
  for (const cv::Mat& pixels : {colour, grey}) {
    for (const int progressive : {0, 1}) {
      for (const int quality : {20, 95}) {
        sensor_msgs::CompressedImage message;
        cv::imencode(".jpg", pixels, message.data,
                     {cv::IMWRITE_JPEG_PROGRESSIVE, progressive, cv::IMWRITE_JPEG_QUALITY, quality});
        const cv::Mat expected = cv::imdecode(message.data, cv::IMREAD_GRAYSCALE);
        EXPECT_EQ(cv::norm(toGrey(message), expected, cv::NORM_INF), 0.0) << pixels.channels() << progressive;
      }
    }
  }
}

TEST(ImageConversion, EveryTruncatedProgressiveJpegIsRefused) {
  sensor_msgs::CompressedImage whole;
  cv::imencode(".jpg", cv::Mat(48, 64, CV_8UC1, cv::Scalar(9)), whole.data, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_EQ(toGrey(whole).size(), cv::Size(64, 48));
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

std::size_t find(const std::vector<std::uint8_t>& data, const std::vector<std::uint8_t>& what) {
  return static_cast<std::size_t>(std::search(data.begin(), data.end(), what.begin(), what.end()) - data.begin());
}

std::string refusalOfImage(const sensor_msgs::CompressedImage& message) {
  return test::refusalOf<ImageError>([&] { toGrey(message); });
}

TEST(ImageConversion, ASizeInFrontOfTheOneThatTheDecoderReadsIsNotBelieved) {
  auto message = compressed(".jpg");
  const std::size_t frame = find(message.data, {0xFF, 0xC0});
  for (const std::size_t i : {5U, 7U}) message.data[frame + i] = 0x7F;  // 32 thousand pixels a side
  // A marker without a length; whoever takes the next two bytes, FF E0, for one steps over the frame to a small one.
  insert(message.data, 2, {0xFF, 0xD0});
  const std::size_t end = message.data.size() - 2;
  insert(message.data, end, std::vector<std::uint8_t>(4 + 0xFFE0 - end));
  insert(message.data, message.data.size() - 2, {0xFF, 0xC0, 0, 11, 8, 0, 16, 0, 16, 1, 1, 0x11, 0});
  const std::string refusal = refusalOfImage(message);
  EXPECT_NE(refusal.find("image is too large"), std::string::npos) << refusal;
}

TEST(ImageConversion, RawAndCompressedImagesMayHaveTheSameNumberOfPixels) {
  const cv::Mat largest(4096, 4096, CV_8UC1, cv::Scalar(9));
  cv::Mat too_large(4097, 4096, CV_8UC1, cv::Scalar(9));
  for (const char* extension : {".jpg", ".png"}) {
    sensor_msgs::CompressedImage message;
    cv::imencode(extension, largest, message.data);
    EXPECT_EQ(toGrey(message).size(), largest.size()) << extension;
    cv::imencode(extension, too_large, message.data);
    EXPECT_EQ(refusalOfImage(message),
              "image is too large: 4096x4097 pixels, at most 16777216 are allowed and 16384 a side")
        << extension;
  }
  sensor_msgs::Image raw;
  raw.encoding = "mono8";
  raw.width = raw.step = 4096;
  raw.height = 4097;
  raw.data.resize(std::size_t{4096} * 4097);
  EXPECT_THROW(toGrey(raw), ImageError);
}

TEST(ImageConversion, AJpegOfThousandsOfScansIsRefused) {
  sensor_msgs::CompressedImage message;
  cv::imencode(".jpg", cv::Mat(480, 640, CV_8UC1, cv::Scalar(9)), message.data, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_EQ(toGrey(message).size(), cv::Size(640, 480));
  const std::size_t first = find(message.data, {0xFF, 0xDA});
  const std::vector<std::uint8_t> scan(message.data.begin() + static_cast<std::ptrdiff_t>(first),
                                       message.data.begin() + static_cast<std::ptrdiff_t>(first) + 10);
  for (int i = 0; i < 1000; ++i) insert(message.data, message.data.size() - 2, scan);
  EXPECT_EQ(refusalOfImage(message), "JPEG is broken or has more than 100 scans");
}

TEST(ImageConversion, EveryKindOfPngIsDecodedAsByOpenCv) {
  cv::Mat pixels(31, 37, CV_8UC4);
  cv::randu(pixels, 0, 256);
  std::vector<cv::Mat> kinds{pixels};
  for (const int conversion : {cv::COLOR_BGRA2BGR, cv::COLOR_BGRA2GRAY}) {
    kinds.emplace_back();
    cv::cvtColor(pixels, kinds.back(), conversion);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    kinds.emplace_back();
    kinds[i].convertTo(kinds.back(), CV_16U, 251.0, 3.0);
  }
  for (const cv::Mat& kind : kinds) {
    for (const int two_levels : {0, 1}) {
      if (two_levels == 1 && kind.type() != CV_8UC1) continue;
      sensor_msgs::CompressedImage message;
      cv::imencode(".png", kind, message.data, {cv::IMWRITE_PNG_BILEVEL, two_levels});
      const cv::Mat expected = cv::imdecode(message.data, cv::IMREAD_GRAYSCALE);
      EXPECT_EQ(cv::norm(toGrey(message), expected, cv::NORM_INF), 0.0) << cv::typeToString(kind.type());
    }
  }
}

TEST(ImageConversion, APngWithAPaletteIsDecodedAsByOpenCv) {
  sensor_msgs::CompressedImage message;
  message.data = {0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A, 0x00, 0x00, 0x00, 0x0D, 0x49, 0x48, 0x44, 0x52,
                  0x00, 0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 0x02, 0x02, 0x03, 0x00, 0x00, 0x00, 0x02, 0xC6, 0x95,
                  0xF0, 0x00, 0x00, 0x00, 0x0C, 0x50, 0x4C, 0x54, 0x45, 0xFF, 0x00, 0x00, 0x00, 0xFF, 0x00, 0x00,
                  0x00, 0xFF, 0x5A, 0x5A, 0x5A, 0x51, 0x7F, 0xE0, 0xB6, 0x00, 0x00, 0x00, 0x02, 0x74, 0x52, 0x4E,
                  0x53, 0xFF, 0x00, 0xE5, 0xB7, 0x30, 0x4A, 0x00, 0x00, 0x00, 0x0C, 0x49, 0x44, 0x41, 0x54, 0x78,
                  0x9C, 0x63, 0x90, 0x66, 0x78, 0x02, 0x00, 0x01, 0x39, 0x01, 0x00, 0x45, 0x64, 0x91, 0x9B, 0x00,
                  0x00, 0x00, 0x00, 0x49, 0x45, 0x4E, 0x44, 0xAE, 0x42, 0x60, 0x82};
  const cv::Mat expected = cv::imdecode(message.data, cv::IMREAD_GRAYSCALE);
  ASSERT_EQ(expected.size(), cv::Size(4, 2));
  EXPECT_EQ(cv::norm(toGrey(message), expected, cv::NORM_INF), 0.0);
}

TEST(ImageConversion, CompressedTextInAPngTakesNoMemory) {
  const std::vector<std::uint8_t> text(7'900'000, 'x');
  std::vector<std::uint8_t> chunk(::compressBound(text.size()));
  uLongf size = chunk.size();
  ASSERT_EQ(::compress(chunk.data(), &size, text.data(), text.size()), Z_OK);
  chunk.resize(size);
  insert(chunk, 0, {'z', 'T', 'X', 't', 'a', 0, 0});
  insert(chunk, chunk.size(), bigEndian(::crc32(0, chunk.data(), static_cast<uInt>(chunk.size())), 4));
  insert(chunk, 0, bigEndian(chunk.size() - 8, 4));
  auto message = compressed(".png");
  const cv::Mat expected = toGrey(message);
  // behind the header and before the end
  for (int i = 0; i < 50; ++i) insert(message.data, i % 2 == 0 ? message.data.size() - 12 : 33, chunk);
  rusage before{};
  ::getrusage(RUSAGE_SELF, &before);
  EXPECT_EQ(cv::norm(toGrey(message), expected, cv::NORM_INF), 0.0);
  rusage after{};
  ::getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 100 * 1024);  // kB; 400 MB with the texts
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
