#include "test/support/synthetic.h"

#include <cmath>
#include <random>

#include <opencv2/imgproc.hpp>

#include "base/numbers.h"
#include "visual_localization/features/sift.h"

namespace visual_localization::test {

std::vector<std::uint8_t> descriptor(const std::vector<int>& first_bins) {
  std::vector<std::uint8_t> bytes(kSiftDimension, 0);
  for (std::size_t i = 0; i < first_bins.size(); ++i) bytes[i] = static_cast<std::uint8_t>(first_bins[i]);
  return bytes;
}

LocalFeatures featuresOf(const std::vector<std::vector<std::uint8_t>>& descriptors) {
  std::vector<Keypoint> keypoints(descriptors.size());
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    keypoints[i].x_px = static_cast<float>(i);
    bytes.insert(bytes.end(), descriptors[i].begin(), descriptors[i].end());
  }
  return LocalFeatures(std::move(keypoints), std::move(bytes));
}

LocalFeatures randomFeatures(std::size_t count, std::uint32_t seed) {
  std::mt19937 engine(seed);
  std::uniform_int_distribution<int> byte(0, 255);
  std::vector<std::vector<std::uint8_t>> descriptors(count);
  for (auto& bytes : descriptors) {
    bytes.resize(kSiftDimension);
    for (auto& value : bytes) value = static_cast<std::uint8_t>(byte(engine));
  }
  return featuresOf(descriptors);
}

std::shared_ptr<const TrainingMap> mapAt(const std::vector<Eigen::Vector2d>& positions_m) {
  std::vector<TrainingImage> images(positions_m.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Eigen::Vector2d step = positions_m[(i + 1) % images.size()] - positions_m[i];
    images[i].stamp_ns = static_cast<std::int64_t>(i) * 1000000000;
    images[i].position_m = positions_m[i];
    images[i].yaw_rad = std::atan2(step.y(), step.x());
  }
  MapHeader header;
  header.datum = {48.5, 9.0, 400.0};
  header.image_size = {320, 240};
  header.sessions = {{"synthetic"}};
  return std::make_shared<TrainingMap>(header, std::move(images));
}

std::vector<Eigen::Vector2d> circle(std::size_t count, double radius_m) {
  std::vector<Eigen::Vector2d> positions(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2.0 * kPi * static_cast<double>(i) / static_cast<double>(count);
    positions[i] = radius_m * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return positions;
}

std::vector<Eigen::Vector2d> street(std::size_t count, double spacing_m) {
  std::vector<Eigen::Vector2d> positions(count);
  for (std::size_t i = 0; i < count; ++i) positions[i] = {static_cast<double>(i) * spacing_m, 0.0};
  return positions;
}

cv::Mat wall(int width_px, int height_px, std::uint32_t seed) {
  cv::RNG random(seed);
  cv::Mat image(height_px, width_px, CV_8UC1, cv::Scalar(128));
  const int blocks = width_px * height_px / 400;
  for (int i = 0; i < blocks; ++i) {
    const cv::Rect block(random.uniform(0, width_px), random.uniform(0, height_px), random.uniform(5, 30),
                         random.uniform(5, 30));
    cv::rectangle(image, block, cv::Scalar(random.uniform(0, 256)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, cv::Size(), 1.0);
  return image;
}

cv::Mat viewOf(const cv::Mat& wall, int left_px) { return wall(cv::Rect(left_px, 0, 320, 240)).clone(); }

}  // namespace visual_localization::test
