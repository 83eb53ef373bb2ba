#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/Image.h>

#include "ros/message_readers.h"
#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/bag/bag_reader.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

sensor_msgs::CameraInfo example() {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  info.distortion_model = "plumb_bob";
  info.D = {-0.1, 0.01, 1e-4, -1e-4, 0.0};
  info.K = {500.0, 0.0, 320.0, 0.0, 501.0, 240.0, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {480.0, 0.0, 318.0, -60.0, 0.0, 480.0, 238.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

template <class Change>
std::string refusalOf(Change change) {
  sensor_msgs::CameraInfo info = example();
  change(info);
  return test::refusalOf<CameraError>([&info] { toCamera(info); });
}

TEST(CameraInfo, IsReadFieldByField) {
  const CameraModel camera = toCamera(example()).value();
  const Intrinsics& values = camera.intrinsics();
  EXPECT_EQ(camera.size(), cv::Size(640, 480));
  EXPECT_EQ(values.fx, 500.0);
  EXPECT_EQ(values.fy, 501.0);
  EXPECT_EQ(values.cx, 320.0);
  EXPECT_EQ(values.cy, 240.0);
  EXPECT_EQ(values.coefficients, example().D);
}

TEST(CameraInfo, IsWrittenAsItIsRead) {
  Intrinsics lens{{640, 480}, 500.0, 510.0, 321.5, 238.0, Distortion::kEquidistant, {0.01, -0.002, 0.0003, 0.0}};
  for (const Distortion distortion : {Distortion::kEquidistant, Distortion::kPlumbBob}) {
    lens.distortion = distortion;
    const auto camera = toCamera(toMessage(CameraModel(lens)));
    ASSERT_TRUE(camera);
    EXPECT_EQ(camera->size(), lens.size);
    EXPECT_EQ(camera->intrinsics().fx, lens.fx);
    EXPECT_EQ(camera->intrinsics().fy, lens.fy);
    EXPECT_EQ(camera->intrinsics().cx, lens.cx);
    EXPECT_EQ(camera->intrinsics().cy, lens.cy);
    EXPECT_EQ(camera->intrinsics().distortion, distortion);
    EXPECT_EQ(camera->intrinsics().coefficients, lens.coefficients);
  }
}

TEST(CameraInfo, OfZerosMeansNotCalibrated) {
  EXPECT_FALSE(toCamera(sensor_msgs::CameraInfo()));
  EXPECT_FALSE(toCamera(sensor_msgs::CameraInfo(), true));
}

// A driver of stereo cameras fills P alone (luxonis/depthai-ros#598).
TEST(CameraInfo, OfPAloneCalibratesRectifiedImagesAlone) {
  sensor_msgs::CameraInfo info = example();
  info.K.fill(0.0);
  info.distortion_model = "rational_polynomial";
  info.D.assign(8, 0.0);
  EXPECT_FALSE(toCamera(info));
  EXPECT_EQ(toCamera(info, true).value().intrinsics().fx, 480.0);
}

// As camera_calibration writes them with too few views (ros-perception/image_pipeline#598), and a rectification of
// zeros (stereolabs/zed-ros-wrapper#126).
TEST(CameraInfo, ZerosForDistortionAndRectificationMeanNone) {
  sensor_msgs::CameraInfo info = example();
  info.distortion_model = "rational_polynomial";
  info.D.assign(8, 0.0);
  info.R.fill(0.0);
  EXPECT_TRUE(toCamera(info).value().isPinhole());
}

TEST(CameraInfo, RectifiedImagesHaveNoDistortion) {
  const CameraModel camera = toCamera(example(), true).value();
  EXPECT_TRUE(camera.isPinhole());
  EXPECT_EQ(camera.intrinsics().fx, 480.0);
  EXPECT_EQ(camera.intrinsics().cy, 238.0);
}

TEST(CameraInfo, NeedsNoLensModelWithoutDistortion) {
  sensor_msgs::CameraInfo info = example();
  info.distortion_model.clear();
  info.D.clear();
  EXPECT_TRUE(toCamera(info).value().isPinhole());
}

TEST(CameraInfo, BinnedPixelsAndRegionsAreThoseOfTheImage) {
  const Eigen::Vector3d point(0.2, -0.1, 1.0);
  const Eigen::Vector2d full = toCamera(example()).value().project(point);
  sensor_msgs::CameraInfo info = example();
  info.roi.x_offset = 100;
  info.roi.y_offset = 40;
  info.roi.width = 400;
  info.roi.height = 300;
  const CameraModel cut = toCamera(info).value();
  EXPECT_EQ(cut.size(), cv::Size(400, 300));
  EXPECT_LT((cut.project(point) - (full - Eigen::Vector2d(100.0, 40.0))).norm(), 1e-9);
  info.binning_x = 2;
  info.binning_y = 4;
  const CameraModel binned = toCamera(info).value();
  EXPECT_EQ(binned.size(), cv::Size(200, 75));
  const Eigen::Vector2d expected(0.5 * (full.x() - 100.0 + 0.5) - 0.5, 0.25 * (full.y() - 40.0 + 0.5) - 0.5);
  EXPECT_LT((binned.project(point) - expected).norm(), 1e-9);
}

TEST(CameraInfo, WhatCannotBeIsRefusedByName) {
  EXPECT_EQ(refusalOf([](auto&) {}), "accepted");
  EXPECT_THAT(refusalOf([](auto& info) { info.K[0] = 0.0; }), HasSubstr("fx = 0 is not in"));
  EXPECT_THAT(refusalOf([](auto& info) { info.K[4] = kNan; }), HasSubstr("fy = nan"));
  EXPECT_THAT(refusalOf([](auto& info) { info.D[1] = kNan; }), HasSubstr("coefficient 1 = nan"));
  EXPECT_THAT(refusalOf([](auto& info) { info.K[1] = 3.0; }), HasSubstr("K[1] = 3, must be 0"));
  EXPECT_THAT(refusalOf([](auto& info) { info.K[8] = 0.0; }), HasSubstr("K[8] = 0, must be 1"));
  EXPECT_THAT(refusalOf([](auto& info) { info.width = 0; }), HasSubstr("image size 0 x 480"));
  EXPECT_THAT(refusalOf([](auto& info) { info.height = 4000000000U; }), HasSubstr("640 x 4000000000"));
  EXPECT_THAT(refusalOf([](auto& info) { info.distortion_model = "fov"; }), HasSubstr("distortion model 'fov'"));
  EXPECT_THAT(refusalOf([](auto& info) {
                info.distortion_model = "";
                info.D.resize(4);
              }),
              HasSubstr("distortion model ''"));
  EXPECT_THAT(refusalOf([](auto& info) { info.D.resize(1000000); }), HasSubstr("at most 14 coefficients, not 1000000"));
  EXPECT_THAT(refusalOf([](auto& info) { info.binning_x = 1000; }), HasSubstr("binning 1000"));
  EXPECT_THAT(refusalOf([](auto& info) { info.roi.width = 700; }), HasSubstr("region of interest 700 x 0"));
  EXPECT_THAT(refusalOf([](auto& info) {
                info.roi.x_offset = 4294967295U;
                info.roi.width = info.roi.height = 2;
              }),
              HasSubstr("is not in the image of 640 x 480"));
}

// Memory that a driver never wrote (introlab/rtabmap_ros#297).
TEST(CameraInfo, OfStrayMemoryIsRefusedByName) {
  EXPECT_THAT(refusalOf([](auto& info) {
                info.K = {772.868570835972, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 6.94825075394135e-310, 2.5e-323};
              }),
              HasSubstr("K[7] = 6.94825e-310, must be 0"));
}

TEST(CameraInfo, ChangesAreSeen) {
  sensor_msgs::CameraInfo later = example();
  later.header.seq = 7;
  later.header.stamp = ros::Time(5.0);
  EXPECT_TRUE(sameCalibration(example(), later));
  later.K[0] += 1e-7;  // as of a driver that computes it anew for each image
  EXPECT_TRUE(sameCalibration(example(), later));
  later.K[0] += 0.01;
  EXPECT_FALSE(sameCalibration(example(), later));
  later = example();
  later.D[3] += 1e-5;
  EXPECT_FALSE(sameCalibration(example(), later));
  later = example();
  later.roi.width = 1;
  EXPECT_FALSE(sameCalibration(example(), later));
}

TEST(CameraInfo, StandsBesideTheImages) {
  EXPECT_EQ(cameraInfoTopic("/stereo/left/image_raw"), "/stereo/left/camera_info");
  EXPECT_EQ(cameraInfoTopic("/stereo/left/image_raw/compressed"), "/stereo/left/camera_info");
  EXPECT_EQ(cameraInfoTopic("/camera"), "/camera_info");
  EXPECT_FALSE(isRectified("/left/image_raw"));
  EXPECT_TRUE(isRectified("/left/image_rect_color/compressed"));
}

std::string yaml(const std::string& camera_matrix = "[500, 0, 320, 0, 501, 240, 0, 0, 1]",
                 const std::string& model = "plumb_bob", const std::string& d = "cols: 5\n  data: [0, 0, 0, 0, 0]") {
  return "image_width: 640\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: " +
         camera_matrix + "\ndistortion_model: " + model + "\ndistortion_coefficients:\n  rows: 1\n  " + d +
         "\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nprojection_matrix:\n"
         "  rows: 3\n  cols: 4\n  data: [500, 0, 320, 0, 0, 501, 240, 0, 0, 0, 1, 0]\n";
}

class CameraFile : public testing::Test {
 protected:
  std::string refusal(const std::string& content, const std::string& name = "camera.yaml") const {
    const std::string path = folder_ / name;
    test::writeAll(path, content);
    const std::string text = test::refusalOf<CameraError>([&path] { readCameraFile(path); });
    EXPECT_THAT(text, AnyOf("accepted", StartsWith(path)));
    EXPECT_LT(text.size(), path.size() + 400) << text;
    return text;
  }

  test::TemporaryFolder folder_;
};

TEST_F(CameraFile, OfCameraCalibrationIsRead) {
  test::writeAll(folder_ / "camera.yaml", yaml());
  const CameraModel camera = readCameraFile(folder_ / "camera.yaml");
  EXPECT_EQ(describe(camera), "640 x 480 px, focal length 500 x 501 px, no distortion");
  EXPECT_NO_THROW(readCameraFile(std::string(TEST_DATA_DIR) + "/calibration/campus.yaml"));
}

TEST_F(CameraFile, OfOpenCvIsRead) {
  test::writeAll(folder_ / "camera.yml",
                 "%YAML:1.0\n---\ncalibration_time: \"Mon\"\nimage_width: 640\nimage_height: 480\nflags: 0\n"
                 "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 5.0e+02, 0., 320., 0.,\n"
                 "       501., 240., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n"
                 "   dt: d\n   data: [ -0.1, 0.01, 0., 0., 0. ]\navg_reprojection_error: 2.1e-01\n");
  const CameraModel camera = readCameraFile(folder_ / "camera.yml");
  EXPECT_EQ(camera.intrinsics().fx, 500.0);
  EXPECT_EQ(camera.intrinsics().cy, 240.0);
  EXPECT_EQ(camera.intrinsics().coefficients.at(0), -0.1);
  EXPECT_EQ(camera.intrinsics().distortion, Distortion::kPlumbBob);
}

TEST_F(CameraFile, NeedsNoMoreThanSizeMatrixAndDistortion) {
  const std::string whole = yaml();
  EXPECT_EQ(refusal(whole.substr(0, whole.find("rectification_matrix"))), "accepted");
  EXPECT_THAT(refusal("%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"), HasSubstr("camera_matrix"));
  EXPECT_THAT(refusal("%YAML:1.0"), HasSubstr("must be a mapping"));
}

TEST_F(CameraFile, MayBeAnIniFile) {
  test::writeAll(folder_ / "camera.ini",
                 "# Camera intrinsics\n\n[image]\n\nwidth\n640\n\nheight\n480\n\n[left]\n\ncamera matrix\n500 0 320 \n"
                 "0 501 240 \n0 0 1 \n\ndistortion\n-0.1 0.01 0.0001 -0.0001 0 \n\nrectification\n1 0 0 \n0 1 0 \n"
                 "0 0 1 \n\nprojection\n500 0 320 0 \n0 501 240 0 \n0 0 1 0 \n");
  const CameraModel camera = readCameraFile(folder_ / "camera.ini");
  EXPECT_EQ(camera.intrinsics().fy, 501.0);
  EXPECT_EQ(camera.intrinsics().coefficients.size(), 5U);
  EXPECT_THAT(refusal("[image]\nwidth\nx\n", "bad.ini"), HasSubstr("is no camera calibration"));
}

TEST_F(CameraFile, IsRefusedWithPathAndKey) {
  EXPECT_EQ(refusal(yaml()), "accepted");
  EXPECT_THAT(refusal(yaml(), "camera.txt"), HasSubstr("must end in .yaml, .yml or .ini"));
  EXPECT_THAT(refusal(""), HasSubstr("must be a mapping"));
  EXPECT_THAT(refusal("image_width: 3"), HasSubstr("image_height"));
  EXPECT_THAT(refusal("{"), HasSubstr("not valid YAML"));
  EXPECT_THAT(refusal(yaml("[.nan, 0, 320, 0, 501, 240, 0, 0, 1]")), HasSubstr("fx = nan"));
  EXPECT_THAT(refusal(yaml("[0, 0, 320, 0, 501, 240, 0, 0, 1]")), HasSubstr("fx = 0"));
  EXPECT_THAT(refusal(yaml("[0, 0, 0, 0, 0, 0, 0, 0, 0]")), HasSubstr("is not calibrated"));
  EXPECT_THAT(refusal(yaml("[500, 0, 320, 0]")), HasSubstr("camera_matrix"));
  EXPECT_THAT(refusal(yaml("[500, 0, 320, 0, far, 240, 0, 0, 1]")), HasSubstr("must hold numbers only"));
  EXPECT_THAT(refusal(yaml("none")), HasSubstr("must be a list"));
  EXPECT_THAT(refusal(yaml("[500, 0, 320, 0, 501, 240, 0, 0, 1]", "fov")), HasSubstr("'fov'"));
  EXPECT_THAT(refusal(yaml("[500, 0, 320, 0, 501, 240, 0, 0, 1]", "equidistant", "cols: 5\n  data: [0, 0, 0, 0, 0.1]")),
              HasSubstr("takes 4"));
}

TEST_F(CameraFile, TakesNoMemoryForWhatItClaims) {
  const std::string matrix = "[500, 0, 320, 0, 501, 240, 0, 0, 1]";
  EXPECT_THAT(refusal(yaml(matrix, "plumb_bob", "cols: 2000000000\n  data: [0]")), HasSubstr("cols"));
  EXPECT_THAT(refusal(yaml(matrix, "plumb_bob", "cols: -5\n  data: [0]")), HasSubstr("cols"));
  EXPECT_THAT(refusal(yaml(matrix, "plumb_bob", "cols: 14\n  data: [0]")), HasSubstr("as many values"));
  EXPECT_THAT(refusal(std::string(70000, '#')), HasSubstr("more than the 65536 bytes"));
  std::string bomb = "a0: &a0 [1, 1]\n";
  for (int i = 1; i < 40; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before + ", " + before + "]\n";
  }
  EXPECT_EQ(refusal(bomb + yaml()), "accepted") << "nobody looks at it";
  EXPECT_THAT(refusal(bomb + yaml("*a39")), HasSubstr("must hold numbers only"));
  EXPECT_NE(refusal(std::string(60000, '[')), "accepted");
}

class BagCamera : public testing::Test {
 protected:
  /// Images with these calibrations beside them, one a second.
  void write(const std::vector<sensor_msgs::CameraInfo>& infos) const {
    rosbag::Bag bag(path_, rosbag::bagmode::Write);
    bag.write("/left/image_raw", ros::Time(1.0), sensor_msgs::Image());
    double time_s = 1.0;
    for (const sensor_msgs::CameraInfo& info : infos) bag.write("/left/camera_info", ros::Time(time_s++), info);
  }
  std::string refusal() const {
    return test::refusalOf<BagError>([this] { BagReader(path_).camera("/left/image_raw"); });
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "recording.bag";
};

TEST_F(BagCamera, IsThatBesideTheImages) {
  sensor_msgs::CameraInfo later = example();
  later.header.seq = 9;
  write({example(), later});
  for (const char* topic : {"/left/image_raw", "/left/image_raw/compressed"}) {
    EXPECT_EQ(BagReader(path_).camera(topic), toCamera(example())) << topic;
  }
  EXPECT_FALSE(BagReader(path_).camera("/right/image_raw"));
  EXPECT_TRUE(BagReader(path_).camera("/left/image_rect").value().isPinhole());
}

TEST_F(BagCamera, WithoutCalibrationThereIsNone) {
  write({});
  EXPECT_FALSE(BagReader(path_).camera("/left/image_raw"));
  write({sensor_msgs::CameraInfo()});
  EXPECT_FALSE(BagReader(path_).camera("/left/image_raw"));
}

TEST_F(BagCamera, MessagesThatAreNotCalibratedDoNotCount) {
  sensor_msgs::CameraInfo jitter = example();
  jitter.K[0] += 1e-7;
  jitter.P[0] -= 1e-7;
  write({sensor_msgs::CameraInfo(), example(), sensor_msgs::CameraInfo(), jitter});
  EXPECT_EQ(BagReader(path_).camera("/left/image_raw"), toCamera(example()));
  sensor_msgs::CameraInfo unrectified = example();
  unrectified.P.fill(0.0);
  write({unrectified, example()});
  EXPECT_EQ(BagReader(path_).camera("/left/image_rect"), toCamera(example(), true));
}

TEST_F(BagCamera, ThatChangesOrCannotBeIsRefused) {
  sensor_msgs::CameraInfo other = example();
  other.K[0] = 510.0;
  write({example(), example(), example(), other});
  EXPECT_THAT(refusal(), AllOf(StartsWith(path_), HasSubstr("/left/camera_info"), HasSubstr("changes 3 s after"),
                               HasSubstr("--camera-info")));
  other.K[0] = kNan;
  write({other});
  EXPECT_NE(refusal(), "accepted");
}

TEST_F(BagCamera, WhoseLengthsLieIsRefused) {
  write({example()});
  std::string bytes = test::readAll(path_);
  // Behind the model, a string with its own length, stands the number of coefficients.
  const std::string model("\x09\0\0\0plumb_bob", 13);
  const std::size_t at = bytes.find(model);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at + model.size(), 4, "\xFF\xFF\xFF\xFF");
  test::writeAll(path_, bytes);
  EXPECT_THAT(refusal(), HasSubstr("shorter than its lengths claim"));
}

}  // namespace
}  // namespace visual_localization
