#include "visual_localization/camera/camera_model.h"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Intrinsics pinhole() { return {{320, 240}, 266.28, 260.5, 159.5, 119.5, Distortion::kPlumbBob, {}}; }

Intrinsics plumbBob() {
  return {{640, 480}, 460.0, 455.0, 322.0, 245.0, Distortion::kPlumbBob, {-0.28, 0.07, 0.0002, -0.0001, 0.005}};
}

Intrinsics rational() {
  return {{640, 480},
          600.0,
          610.0,
          318.0,
          240.0,
          Distortion::kRationalPolynomial,
          {0.2, -0.1, 0.0005, 0.0002, 0.01, 0.4, -0.05, 0.02}};
}

Intrinsics fisheye() {
  return {{640, 480}, 300.0, 301.0, 320.5, 239.0, Distortion::kEquidistant, {-0.01, 0.004, -0.003, 0.0005}};
}

std::string refusalOfLens(const Intrinsics& intrinsics) {
  return test::refusalOf<CameraError>([&] { const CameraModel camera(intrinsics); });
}

Eigen::Vector2d projectedByOpenCv(const Intrinsics& values, const Eigen::Vector3d& point) {
  const cv::Matx33d camera(values.fx, 0.0, values.cx, 0.0, values.fy, values.cy, 0.0, 0.0, 1.0);
  const std::vector<cv::Point3d> points = {{point.x(), point.y(), point.z()}};
  const cv::Vec3d zero(0.0, 0.0, 0.0);
  std::vector<cv::Point2d> pixels;
  if (values.distortion == Distortion::kEquidistant) {
    cv::fisheye::projectPoints(points, pixels, zero, zero, camera, values.coefficients);
  } else {
    cv::projectPoints(points, zero, zero, camera, values.coefficients, pixels);
  }
  return {pixels[0].x, pixels[0].y};
}

std::vector<Eigen::Vector2d> cornersAndMore(const cv::Size& size) {
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i <= 10; ++i) {
    for (int j = 0; j <= 10; ++j) pixels.emplace_back((size.width - 1) * i / 10.0, (size.height - 1) * j / 10.0);
  }
  return pixels;
}

class EveryLens : public testing::TestWithParam<Intrinsics> {};

TEST_P(EveryLens, ProjectsLikeOpenCv) {
  const CameraModel camera(GetParam());
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(0.0, 0.0, 2.0), Eigen::Vector3d(0.7, -0.4, 2.0), Eigen::Vector3d(-1.0, 0.8, 2.5)}) {
    EXPECT_LT((camera.project(point) - projectedByOpenCv(GetParam(), point)).norm(), 1e-9);
  }
}

TEST_P(EveryLens, UndoesItsDistortionUpToTheCorners) {
  const CameraModel camera(GetParam());
  EXPECT_EQ(camera.usableShare(), 1.0);
  const std::vector<Eigen::Vector2d> pixels = cornersAndMore(camera.size());
  const std::vector<Eigen::Vector2d> rays = camera.undistort(pixels);
  ASSERT_EQ(rays.size(), pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    EXPECT_LT((camera.project(3.0 * rays[i].homogeneous()) - pixels[i]).norm(), 0.01) << pixels[i].transpose();
  }
}

TEST_P(EveryLens, SeesTheSameWithItsImagesResized) {
  const CameraModel camera(GetParam());
  const CameraModel half = camera.scaledTo(camera.size() / 2);
  const Eigen::Vector3d point(0.3, -0.2, 1.5);
  const Eigen::Vector2d pixel = camera.project(point);
  // The pixel centre (0.5, 0.5) of the large image is the centre of the first pixel of the small one.
  EXPECT_LT((half.project(point) - (pixel - Eigen::Vector2d(0.5, 0.5)) / 2.0).norm(), 1e-9);
  EXPECT_LT((half.scaledTo(camera.size()).project(point) - pixel).norm(), 1e-9);
  EXPECT_EQ(half.size(), camera.size() / 2);
}

TEST_P(EveryLens, ComesBackFromNamedValues) {
  const CameraModel camera(GetParam());
  EXPECT_EQ(cameraOf(toValues(camera)), camera);
  const CameraModel scaled = camera.scaledTo({333, 77});
  EXPECT_EQ(cameraOf(toValues(scaled)), scaled);
}

INSTANTIATE_TEST_SUITE_P(CameraModel, EveryLens, testing::Values(pinhole(), plumbBob(), rational(), fisheye()));

TEST(CameraModel, PinholeIsLinear) {
  Intrinsics zeros = pinhole();
  zeros.coefficients.assign(5, 0.0);
  for (const Intrinsics& values : {pinhole(), zeros}) {
    const CameraModel camera(values);
    EXPECT_TRUE(camera.isPinhole());
    const Eigen::Vector2d ray = camera.undistort({{0.0, 239.0}}).front();
    EXPECT_EQ(ray.x(), (0.0 - 159.5) / 266.28);
    EXPECT_EQ(ray.y(), (239.0 - 119.5) / 260.5);
  }
  EXPECT_FALSE(CameraModel(fisheye()).isPinhole());
  EXPECT_TRUE(CameraModel(plumbBob()).undistort({}).empty());
}

TEST(CameraModel, RefusesNumbersOutsideTheirRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto with = [](auto change) {
    Intrinsics values = plumbBob();
    change(values);
    return refusalOfLens(values);
  };
  EXPECT_EQ(with([](Intrinsics&) {}), "accepted");
  EXPECT_THAT(with([](Intrinsics& v) { v.fx = 0.0; }), HasSubstr("fx = 0 is not in [64, 64000]"));
  EXPECT_THAT(with([](Intrinsics& v) { v.fy = -455.0; }), HasSubstr("fy = -455"));
  EXPECT_THAT(with([=](Intrinsics& v) { v.fy = nan; }), HasSubstr("fy = nan"));
  EXPECT_THAT(with([](Intrinsics& v) { v.cx = 1e4; }), HasSubstr("cx = 10000 is not in [-320.5, 959.5]"));
  EXPECT_THAT(with([=](Intrinsics& v) { v.cy = nan; }), HasSubstr("cy"));
  EXPECT_THAT(with([](Intrinsics& v) { v.size.width = 0; }), HasSubstr("image width = 0"));
  EXPECT_THAT(with([](Intrinsics& v) { v.size.height = 40000; }), HasSubstr("image height = 40000"));
  EXPECT_THAT(with([=](Intrinsics& v) { v.coefficients[3] = nan; }), HasSubstr("coefficient 3 = nan"));
  EXPECT_THAT(with([](Intrinsics& v) { v.coefficients[0] = 1e300; }), HasSubstr("coefficient 0 = 1e+300"));
  EXPECT_THAT(with([](Intrinsics& v) { v.coefficients.resize(3); }),
              AllOf(HasSubstr("plumb_bob takes 0, 4 or 5"), HasSubstr("not 3")));
  EXPECT_THAT(with([](Intrinsics& v) { v.distortion = Distortion::kRationalPolynomial; }),
              AllOf(HasSubstr("rational_polynomial takes 8"), HasSubstr("not 5")));
  EXPECT_THAT(with([](Intrinsics& v) { v.distortion = Distortion::kEquidistant; }), HasSubstr("takes 4"));
}

TEST(CameraModel, RefusesADistortionThatCannotBeUndone) {
  Intrinsics folded = plumbBob();
  folded.coefficients = {-5.0, 0.0, 0.0, 0.0};  // the radius shrinks from 0.26 on, 120 pixels from the centre
  EXPECT_THAT(refusalOfLens(folded), HasSubstr("cannot be undone at pixel"));
}

TEST(CameraModel, MarksPixelsBeyondAFishEyeLens) {
  Intrinsics circle = fisheye();
  circle.fx = circle.fy = 170.0;  // 85 degrees are at 252 pixels: wider than high, the corners are black
  circle.coefficients = {0.0, 0.0, 0.0, 0.0};
  const CameraModel camera(circle);
  EXPECT_LT(camera.usableShare(), 0.9);
  EXPECT_GT(camera.usableShare(), 0.5);
  EXPECT_THAT(describe(camera), HasSubstr("% of the image can be undistorted"));
  const std::vector<Eigen::Vector2d> rays = camera.undistort({{0.0, 0.0}, {320.0, 239.0}});
  EXPECT_TRUE(std::isnan(rays[0].x()) && std::isnan(rays[0].y()));
  EXPECT_TRUE(rays[1].allFinite());
}

TEST(CameraModel, DoesNotSeeWhatIsBehindItOrFoldedBack) {
  const CameraModel camera(plumbBob());
  EXPECT_FALSE(camera.project({0.0, 0.0, -1.0}).allFinite());
  EXPECT_FALSE(camera.project({0.0, 0.0, 0.0}).allFinite());
  Intrinsics barrel = plumbBob();
  barrel.coefficients = {-0.3, 0.0, 0.0, 0.0};  // a ray at 1.83 would be shown in the middle of the image
  EXPECT_TRUE(CameraModel(barrel).project({1.0, 0.0, 1.0}).allFinite());
  EXPECT_FALSE(CameraModel(barrel).project({1.83, 0.0, 1.0}).allFinite());
  EXPECT_FALSE(CameraModel(pinhole()).project({100.0, 0.0, 1.0}).allFinite());
}

TEST(CameraModel, RefusesAnImpossibleSize) {
  EXPECT_THROW(CameraModel(pinhole()).scaledTo({0, 240}), CameraError);
  EXPECT_THROW(CameraModel(pinhole()).scaledTo({320, 1 << 20}), CameraError);
}

TEST(CameraModel, SaysHowCamerasDiffer) {
  const CameraModel camera(pinhole());
  EXPECT_EQ(differences(camera, camera), "");
  EXPECT_EQ(describe(camera), "320 x 240 px, focal length 266.3 x 260.5 px, no distortion");
  const std::string words = differences(CameraModel(fisheye()), camera);
  EXPECT_THAT(words, AllOf(HasSubstr("size 640 x 480 instead of 320 x 240"), HasSubstr("fx 300 instead of 266.28"),
                           HasSubstr("distortion equidistant instead of plumb_bob"), HasSubstr("coefficients (-0.01")));
  EXPECT_NE(CameraModel(fisheye()), camera);
}

TEST(CameraModel, RefusesNamedValuesThatAreNone) {
  const ParameterValues good = toValues(CameraModel(plumbBob()));
  const auto with = [&good](const std::string& name, const ParameterValue& value) {
    ParameterValues values = good;
    values[name] = value;
    return values;
  };
  EXPECT_THROW(cameraOf({}), CameraError);
  EXPECT_THROW(cameraOf(with("fx", std::string("wide"))), CameraError);
  EXPECT_THROW(cameraOf(with("fx", 0.0)), CameraError);
  EXPECT_THROW(cameraOf(with("width", std::int64_t{1} << 33)), CameraError);
  EXPECT_THROW(cameraOf(with("d7", 1.0)), CameraError);  // without d5 and d6
  EXPECT_THROW(cameraOf(with("distortion", std::string("fov"))), CameraError);
  EXPECT_THROW(cameraOf(with("zoom", 1.0)), CameraError);
}

}  // namespace
}  // namespace visual_localization
