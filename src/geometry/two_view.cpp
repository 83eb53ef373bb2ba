#include "geometry/two_view.h"

#include <algorithm>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace visual_localization {
namespace {

#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 5)
constexpr int kRobustMethod = cv::USAC_MAGSAC;
#else
constexpr int kRobustMethod = cv::RANSAC;
#endif
constexpr double kConfidence = 0.999;
constexpr std::size_t kMinimalSample = 5;

Eigen::Quaterniond rotationOf(const cv::Mat& matrix) {
  Eigen::Matrix3d rotation;
  cv::cv2eigen(matrix, rotation);
  return Eigen::Quaterniond(rotation).normalized();
}

double angle_rad(const Eigen::Quaterniond& rotation) {
  return rotation.angularDistance(Eigen::Quaterniond::Identity());
}

}  // namespace

std::optional<TwoView> verifyTwoViews(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b,
                                      const std::vector<FeatureMatch>& matches, double tolerance,
                                      std::size_t min_inliers, double max_rotation_rad) {
  if (matches.size() < std::max(min_inliers, kMinimalSample + 1)) return std::nullopt;
  std::vector<cv::Point2d> in_a;
  std::vector<cv::Point2d> in_b;
  for (const FeatureMatch& match : matches) {
    in_a.emplace_back(a[match.a].x(), a[match.a].y());
    in_b.emplace_back(b[match.b].x(), b[match.b].y());
  }
  cv::Mat mask;
  const cv::Mat essential =
      cv::findEssentialMat(in_a, in_b, cv::Mat::eye(3, 3, CV_64F), kRobustMethod, kConfidence, tolerance, mask);
  if (essential.rows != 3 || essential.cols != 3 || !cv::checkRange(essential)) return std::nullopt;

  TwoView view;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (mask.at<unsigned char>(static_cast<int>(i)) != 0) view.inliers.push_back(matches[i]);
  }
  cv::Mat one;
  cv::Mat other;
  cv::Mat direction;
  cv::decomposeEssentialMat(essential, one, other, direction);
  const Eigen::Quaterniond first = rotationOf(one);
  const Eigen::Quaterniond second = rotationOf(other);
  view.b_from_a = angle_rad(first) <= angle_rad(second) ? first : second;
  if (view.inliers.size() < min_inliers || !(angle_rad(view.b_from_a) <= max_rotation_rad)) return std::nullopt;
  return view;
}

}  // namespace visual_localization
