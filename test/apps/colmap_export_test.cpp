#include <array>
#include <cstdint>
#include <iterator>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/map_export.h"
#include "base/files.h"
#include "test/support/example_map.h"
#include "test/support/temporary_folder.h"

namespace visual_localization::apps {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;

constexpr std::array<double, 4> kOffsets_px{0.5, -0.25, 1.0, 0.0};  ///< of a feature from its landmark's projection

std::vector<std::string> wordsOf(const std::string& line) {
  std::istringstream in(line);
  return {std::istream_iterator<std::string>(in), std::istream_iterator<std::string>()};
}

std::vector<std::vector<std::string>> linesOf(const std::string& path) {
  std::istringstream in(test::readAll(path));
  std::vector<std::vector<std::string>> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(wordsOf(line));
  return lines;
}

/// Two landmarks that four images of a drive to the east show, and a third feature that shows none.
std::vector<TrainingImage> seenImages(const CameraModel& camera) {
  const std::array<Eigen::Vector3d, 2> landmarks{Eigen::Vector3d(12.0, 2.0, 3.0), Eigen::Vector3d(15.0, -3.0, 0.5)};
  std::mt19937 random(1);
  std::vector<TrainingImage> images(5);
  for (std::size_t i = 0; i < images.size(); ++i) {
    TrainingImage& image = images[i];
    image.stamp_ns = 1'000'000'000 * static_cast<std::int64_t>(i + 1) + 7;
    image.session = i < 2 ? 0 : 1;
    image.local = test::randomFeatures(3, random);
    if (i == 4) continue;  // not adjusted
    ImageGeometry geometry;
    geometry.camera = {levelCamera(0.05 * static_cast<double>(i)), {static_cast<double>(i), 0.1, 1.0}};
    std::vector<Keypoint> keypoints = image.local.keypoints().list();
    for (std::uint32_t k = 0; k < 2; ++k) {
      const Eigen::Vector2d seen_px = camera.project(geometry.camera.toCamera(landmarks[k]));
      keypoints[k + 1].x_px = static_cast<float>(seen_px.x() + kOffsets_px[i]);
      keypoints[k + 1].y_px = static_cast<float>(seen_px.y());
      const Eigen::Vector3f offset_m = (landmarks[k] - geometry.camera.position_m).cast<float>();
      geometry.landmarks.push_back({k + 1, 40 + k, offset_m, 0.1F, 0.1F});
    }
    image.local = LocalFeatures(keypoints, image.local.bytes());
    image.geometry = geometry;
  }
  return images;
}

TrainingMap seenMap(const CameraModel& camera) {
  MapHeader header = test::exampleHeader();
  header.sessions = {{"mon day/1", camera}, {"mon_day_1", camera}};
  return TrainingMap(header, seenImages(camera));
}

CameraModel exampleCameraOf(Distortion distortion, const std::vector<double>& coefficients) {
  return CameraModel({{320, 240}, 266.25, 266.5, 159.5, 119.25, distortion, coefficients});
}

std::vector<std::string> writtenCamera(const CameraModel& camera) {
  const test::TemporaryFolder folder;
  writeColmap(seenMap(camera), folder.path());
  return linesOf(folder / "cameras.txt").front();
}

TEST(ColmapExport, ThePrincipalPointIsHalfAPixelFarther) {
  EXPECT_THAT(writtenCamera(exampleCameraOf(Distortion::kPlumbBob, {})),
              testing::ElementsAre("1", "PINHOLE", "320", "240", "266.25", "266.5", "160", "119.75"));
}

TEST(ColmapExport, EachLensHasItsModelOfColmap) {
  const auto model = [](Distortion distortion, const std::vector<double>& coefficients) {
    std::vector<std::string> words = writtenCamera(exampleCameraOf(distortion, coefficients));
    words.erase(words.begin() + 2, words.begin() + 8);
    return testing::PrintToString(words);
  };
  const auto words = [](const std::vector<std::string>& expected) { return testing::PrintToString(expected); };
  const std::string opencv = words({"1", "OPENCV", "-0.125", "0.0625", "0.25", "0"});
  const std::vector<double> four{-0.125, 0.0625, 0.25, 0.0};
  EXPECT_EQ(model(Distortion::kPlumbBob, {0.0, 0.0, 0.0, 0.0, 0.0}), words({"1", "PINHOLE"}));
  EXPECT_EQ(model(Distortion::kPlumbBob, four), opencv);
  EXPECT_EQ(model(Distortion::kPlumbBob, {-0.125, 0.0625, 0.25, 0.0, 0.0}), opencv);
  EXPECT_EQ(model(Distortion::kPlumbBob, {-0.125, 0.0625, 0.25, 0.0, 0.5}),
            words({"1", "FULL_OPENCV", "-0.125", "0.0625", "0.25", "0", "0.5", "0", "0", "0"}));
  EXPECT_EQ(model(Distortion::kRationalPolynomial, {-0.125, 0.0625, 0.25, 0.0, 0.5, 0.125, 0.0, 0.25}),
            words({"1", "FULL_OPENCV", "-0.125", "0.0625", "0.25", "0", "0.5", "0.125", "0", "0.25"}));
  EXPECT_EQ(model(Distortion::kEquidistant, {0.0, 0.0, 0.0, 0.0}), words({"1", "OPENCV_FISHEYE", "0", "0", "0", "0"}));
}

TEST(ColmapExport, ImagesHaveNamesWithoutSpacesAndAllTheirFeatures) {
  const test::TemporaryFolder folder;
  const TrainingMap map = seenMap(test::exampleCamera());
  const ColmapSummary model = writeColmap(map, folder.path());
  EXPECT_EQ(model.cameras, 2U);
  EXPECT_EQ(model.images, 4U);
  EXPECT_EQ(model.points, 2U);
  EXPECT_EQ(model.observations, 8U);
  const auto lines = linesOf(folder / "images.txt");
  ASSERT_EQ(lines.size(), 8U) << "two lines for each image with a pose";
  EXPECT_EQ(lines[0].back(), "mon_day_1/1.000000007.png");
  EXPECT_EQ(lines[4].back(), "mon_day_1_1/3.000000007.png") << "the name is taken";
  EXPECT_EQ(lines[4][8], "2") << "camera";
  for (std::size_t i = 0; i < 4; ++i) {
    const std::vector<std::string>& features = lines[2 * i + 1];
    ASSERT_EQ(features.size(), 9U);
    EXPECT_EQ(std::stof(features[0]), map.local(i)->keypoints()[0].x_px + 0.5F);
    EXPECT_EQ(std::stof(features[1]), map.local(i)->keypoints()[0].y_px + 0.5F);
    EXPECT_EQ(features[2] + ' ' + features[5] + ' ' + features[8], "-1 40 41");
  }
}

/// By the words of the lines of a camera (OPENCV) and an image.
Eigen::Vector2d seenByColmap(const std::vector<std::string>& camera, const std::vector<std::string>& image,
                             const Eigen::Vector3d& point_m) {
  const auto number = [](const std::string& word) { return std::stod(word); };
  const Eigen::Quaterniond q(number(image[1]), number(image[2]), number(image[3]), number(image[4]));
  const Eigen::Vector3d t(number(image[5]), number(image[6]), number(image[7]));
  std::array<double, 8> p{};
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = number(camera[i + 4]);
  const Eigen::Vector2d u = (q * point_m + t).hnormalized();
  const double r2 = u.squaredNorm();
  const double radial = p[4] * r2 + p[5] * r2 * r2;
  const double x = u.x() * (1 + radial) + 2 * p[6] * u.x() * u.y() + p[7] * (r2 + 2 * u.x() * u.x());
  const double y = u.y() * (1 + radial) + 2 * p[7] * u.x() * u.y() + p[6] * (r2 + 2 * u.y() * u.y());
  return {p[0] * x + p[2], p[1] * y + p[3]};
}

TEST(ColmapExport, PointsProjectOntoTheirFeaturesUpToTheMapsOwnError) {
  const test::TemporaryFolder folder;
  const ColmapSummary model = writeColmap(seenMap(test::exampleCamera()), folder.path());
  const auto cameras = linesOf(folder / "cameras.txt");
  const auto images = linesOf(folder / "images.txt");
  const double mean_px = (0.5 + 0.25 + 1.0 + 0.0) / 4;
  for (const std::vector<std::string>& point : linesOf(folder / "points3D.txt")) {
    const Eigen::Vector3d at_m(std::stod(point[1]), std::stod(point[2]), std::stod(point[3]));
    EXPECT_NEAR(std::stod(point[7]), mean_px, 1e-4);
    ASSERT_EQ(point.size(), 16U) << "a track of four";
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t feature = std::stoul(point[9 + 2 * k]);
      EXPECT_EQ(images[2 * k][0], point[8 + 2 * k]);
      const std::vector<std::string>& features = images[2 * k + 1];
      EXPECT_EQ(features[3 * feature + 2], point[0]);
      const Eigen::Vector2d seen_px = seenByColmap(cameras[k / 2], images[2 * k], at_m);
      EXPECT_NEAR(std::stod(features[3 * feature]) - seen_px.x(), kOffsets_px[k], 1e-4);
      EXPECT_NEAR(std::stod(features[3 * feature + 1]) - seen_px.y(), 0.0, 1e-4);
    }
  }
  EXPECT_NEAR(model.error_px, mean_px, 1e-4);
}

TEST(ColmapExport, AFolderWithSomethingInItIsLeftAlone) {
  const test::TemporaryFolder folder;
  test::writeAll(folder / "mine", "");
  EXPECT_THROW(writeColmap(seenMap(test::exampleCamera()), folder.path()), FileError);
  EXPECT_THROW(writeColmap(seenMap(test::exampleCamera()), folder / "mine"), FileError);
  EXPECT_THROW(writeColmap(seenMap(test::exampleCamera()), folder / "no/folder"), FileError);
  EXPECT_THROW(writeColmap(seenMap(test::exampleCamera()), ""), FileError);
  EXPECT_THAT(folder.names(), UnorderedElementsAre("mine"));
}

TEST(ColmapExport, AMapWithoutLandmarksLeavesNothing) {
  const test::TemporaryFolder folder;
  MapHeader header = test::exampleHeader();
  header.sessions = {{"without a camera"}, {"without a camera"}};
  for (const std::string& target : {folder.path(), folder / "new"}) {
    try {
      writeColmap(TrainingMap(header, test::exampleImages(20)), target);
      ADD_FAILURE() << "not refused";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr("no landmarks"));
    }
  }
  EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace visual_localization::apps
