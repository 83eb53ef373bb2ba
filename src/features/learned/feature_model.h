#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>

namespace visual_localization {

/// A network that finds and describes local features, from an ONNX file; what it must be like stands in
/// doc/programs.md. Not thread-safe.
class FeatureModel {
 public:
  /// Reads the file and tries it on two small images and a usual one, the first time in a copy of this process: OpenCV
  /// refuses many damaged models, and is ended by others. Throws ParameterError, naming file and fault; when the file
  /// has another checksum than the one given, before OpenCV sees it.
  explicit FeatureModel(const std::string& path, const std::optional<std::string>& checksum = std::nullopt);

  /// Of a descriptor.
  std::size_t dimension() const { return static_cast<std::size_t>(head_.rows()); }
  /// CRC-32 of the file, hexadecimal.
  const std::string& checksum() const { return checksum_; }

  /// `grey`: 8-bit, one channel. Scores and descriptors of the image are kept until the next one.
  void setImage(const cv::Mat& grey);
  /// In [0, 1], float, of the image's size.
  const cv::Mat& scores() const { return scores_; }
  /// Descriptor at a position in pixels, of unit length; zero where the image has none. `descriptor`: dimension().
  void describe(float x_px, float y_px, Eigen::VectorXf& descriptor);

 private:
  /// What a level of the network says, channels x height x width.
  struct Level {
    const float* values = nullptr;
    int channels = 0;
    int height = 0;
    int width = 0;
  };

  void tryInCopy(const std::string& bytes);
  void load(const std::string& bytes);
  void forward(const cv::Mat& grey);
  void takeHead();
  void sample(const Level& level, double x, double y, float* to) const;

  std::string name_;  ///< in errors
  std::string checksum_;
  cv::dnn::Net net_;
  std::vector<std::string> names_;  ///< of the outputs: scores, descriptors level by level, head
  std::vector<cv::Mat> outputs_;
  cv::Mat padded_;
  cv::Mat scores_;
  std::vector<Level> levels_;
  Eigen::MatrixXf head_;      ///< dimension x all channels
  Eigen::VectorXf channels_;  ///< sampled at a position
};

}  // namespace visual_localization
