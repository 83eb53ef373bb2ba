#include "visual_localization/camera/mask.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

/// White but for the lowest quarter.
cv::Mat bonnet(int width = 64, int height = 48) {
  cv::Mat grey(height, width, CV_8U, cv::Scalar(255));
  grey.rowRange(height * 3 / 4, height).setTo(0);
  return grey;
}

class MaskFile : public testing::Test {
 protected:
  std::string write(const cv::Mat& image, const std::string& name = "mask.png") const {
    cv::imwrite(folder_ / name, image);
    return folder_ / name;
  }
  std::string refusal(const std::string& path) const {
    return test::refusalOf<CameraError>([&path] { readMask(path); });
  }

  test::TemporaryFolder folder_;
};

TEST(Mask, AnEmptyOneUsesEverything) {
  const Mask mask;
  EXPECT_TRUE(mask.empty());
  EXPECT_TRUE(mask.allows(1e6F, -5.0F));
  EXPECT_EQ(mask.usedShare(), 1.0);
  EXPECT_TRUE(mask.scaledTo({320, 240}).empty());
  EXPECT_TRUE(mask == Mask());
  EXPECT_TRUE(mask != Mask(bonnet()));
}

TEST(Mask, UsesWhatIsWhiteAtTheNearestPixel) {
  const Mask mask(bonnet());
  EXPECT_TRUE(mask.allows(10.0F, 35.4F));
  EXPECT_FALSE(mask.allows(10.0F, 35.6F));
  EXPECT_TRUE(mask.allows(-3.0F, -3.0F));
  EXPECT_FALSE(mask.allows(1e9F, 1e9F));
  EXPECT_DOUBLE_EQ(mask.usedShare(), 0.75);
}

TEST(Mask, DoesNotChangeWithTheImageItWasMadeOf) {
  cv::Mat grey = bonnet();
  const Mask mask(grey);
  grey.setTo(0);
  EXPECT_TRUE(mask == Mask(bonnet()));
}

TEST(Mask, ScalesWithTheImage) {
  const Mask half = Mask(bonnet()).scaledTo({32, 24});
  EXPECT_TRUE(half == Mask(bonnet(32, 24)));
  cv::Mat speck(48, 64, CV_8U, cv::Scalar(0));
  speck.at<std::uint8_t>(1, 1) = 255;
  EXPECT_THROW(Mask(speck).scaledTo({8, 6}), CameraError);
}

TEST(Mask, RefusesWhatIsNone) {
  EXPECT_THROW(Mask(cv::Mat()), CameraError);
  EXPECT_THROW(Mask(cv::Mat(4, 4, CV_8UC3, cv::Scalar(255, 255, 255))), CameraError);
  EXPECT_THROW(Mask(cv::Mat(4, 4, CV_8U, cv::Scalar(127))), CameraError);
}

TEST(Mask, FitsImagesOfItsShapeOnly) {
  EXPECT_EQ(fittedTo({320, 240}, Mask(bonnet())).size(), cv::Size(320, 240));
  EXPECT_THAT(test::refusalOf<CameraError>([] {
                fittedTo({320, 200}, Mask(bonnet()));
              }),
              HasSubstr("the mask is for 64 x 48 px, but the images have 320 x 200 px"));
  EXPECT_TRUE(fittedTo({320, 200}, Mask()).empty());
}

TEST(CameraModel, FitsImagesOfItsShapeOnly) {
  const CameraModel camera({{1226, 370}, 707.0, 707.0, 601.0, 183.0, Distortion::kPlumbBob, {}});
  EXPECT_EQ(fittedTo({1226, 370}, camera), camera);
  EXPECT_EQ(fittedTo({409, 123}, camera).size(), cv::Size(409, 123));  // a third, rounded
  EXPECT_THAT(test::refusalOf<CameraError>([&camera] {
                fittedTo({1226, 300}, camera);
              }),
              HasSubstr("the calibration is for 1226 x 370"));
}

TEST_F(MaskFile, IsRead) { EXPECT_TRUE(readMask(write(bonnet())) == Mask(bonnet())); }

TEST_F(MaskFile, IsRefusedUnlessItIsAGreyPng) {
  const std::string absent = folder_ / "absent.png";
  EXPECT_THAT(refusal(absent), AllOf(StartsWith(absent), HasSubstr("No such file")));
  EXPECT_THAT(refusal(folder_.path()), StartsWith(folder_.path()));
  EXPECT_THAT(refusal(write(bonnet(), "mask.jpg")), AllOf(StartsWith(folder_.path()), HasSubstr("is not a PNG")));
  EXPECT_THAT(refusal(write(cv::Mat(8, 8, CV_8UC3, cv::Scalar(255, 255, 255)))), HasSubstr("must be grey"));
  EXPECT_THAT(refusal(write(cv::Mat(8, 8, CV_16U, cv::Scalar(65535)))), HasSubstr("8 bits a pixel"));
  EXPECT_THAT(refusal(write(cv::Mat(8, 8, CV_8U, cv::Scalar(0)))), HasSubstr("must use some of the image"));
}

/// Behind the header of a PNG; `chunk`: with its length and checksum.
std::string withChunk(std::string png, const std::string& chunk) { return png.insert(33, chunk); }

TEST_F(MaskFile, GammaDoesNotChangeIt) {
  cv::Mat grey(8, 8, CV_8U, cv::Scalar(100));
  grey.row(0).setTo(128);
  const std::string path = write(grey);
  const std::string linear("\0\0\0\4gAMA\0\1\x86\xA0\x31\xE8\x96\x5F", 16);
  test::writeAll(path, withChunk(test::readAll(path), linear));
  EXPECT_TRUE(readMask(path) == Mask(grey));
}

TEST_F(MaskFile, TransparencyIsRefused) {
  const std::string path = write(bonnet());
  test::writeAll(path, withChunk(test::readAll(path), std::string("\0\0\0\2tRNS\0\xFF\0\0\0\0", 14)));
  EXPECT_THAT(refusal(path), HasSubstr("without transparency"));
}

TEST_F(MaskFile, DamageIsRefused) {
  const std::string path = write(bonnet());
  const std::string whole = test::readAll(path);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    test::writeAll(path, whole.substr(0, length));
    EXPECT_NE(refusal(path), "accepted") << length;
  }
  std::string huge = whole;
  huge.replace(16, 4, "\x7F\xFF\xFF\xFF");  // its width
  test::writeAll(path, huge);
  EXPECT_THAT(refusal(path), HasSubstr("at most 8192 x 8192 are allowed"));
}

}  // namespace
}  // namespace visual_localization
