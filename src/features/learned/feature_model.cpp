#include "features/learned/feature_model.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <new>
#include <set>
#include <stdexcept>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <zlib.h>

#include "base/files.h"
#include "base/process.h"
#include "base/text.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

constexpr std::size_t kLargestFile_bytes = std::size_t{256} << 20U;
constexpr int kStride_px = 32;  ///< width and height of what a network takes are multiples of it
constexpr std::size_t kLargestDimension = 256;
constexpr const char* kScores = "scores";
constexpr const char* kHead = "head";

/// OpenCV writes what it thinks of a file to the terminal, besides throwing it.
class Silence {
 public:
  Silence() : before_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~Silence() { cv::utils::logging::setLogLevel(before_); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  cv::utils::logging::LogLevel before_;
};

std::string hexadecimal(unsigned long value) {
  char text[16];
  std::snprintf(text, sizeof(text), "%08lx", value);
  return text;
}

std::string crc32Of(const std::string& bytes) {
  const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
  return hexadecimal(::crc32(0, data, static_cast<uInt>(bytes.size())));
}

std::string named(const std::string& path) { return "model '" + oneLine(path) + "': "; }

/// OpenCV puts an allocation that is refused into another error.
bool isOutOfMemory(const cv::Exception& error) {
  return error.code == cv::Error::StsNoMem || error.err.find("Insufficient memory") != std::string::npos;
}

std::string inWords(const std::exception& error) {
  const auto* of_opencv = dynamic_cast<const cv::Exception*>(&error);
  const bool out_of_memory =
      of_opencv != nullptr ? isOutOfMemory(*of_opencv) : dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
  if (out_of_memory) return "takes too much memory";
  if (of_opencv != nullptr) return "OpenCV " CV_VERSION " cannot run it: " + oneLine(of_opencv->err);
  return oneLine(error.what());
}

std::string levelName(std::size_t level) { return "descriptors_" + std::to_string(level); }

/// scores, descriptors_0, descriptors_1, ..., head.
std::vector<std::string> outputsOf(const cv::dnn::Net& net) {
  const std::vector<cv::String> there = net.getUnconnectedOutLayersNames();
  const auto has = [&there](const std::string& name) {
    return std::find(there.begin(), there.end(), name) != there.end();
  };
  std::vector<std::string> names{kScores};
  while (has(levelName(names.size() - 1))) names.push_back(levelName(names.size() - 1));
  names.emplace_back(kHead);
  for (const std::string& name : {names.front(), levelName(0), names.back()}) {
    if (!has(name)) throw std::runtime_error("it has no output '" + name + "', only " + oneLine(joined(there), 200));
  }
  if (names.size() == there.size()) return names;
  throw std::runtime_error("it has outputs that nobody knows among " + oneLine(joined(there), 200));
}

bool isPlane(const cv::Mat& output) { return output.dims == 4 && output.size[0] == 1 && output.type() == CV_32F; }

}  // namespace

FeatureModel::FeatureModel(const std::string& path, const std::optional<std::string>& checksum) : name_(named(path)) {
  const Silence silence;
  try {
    if (path.empty()) throw std::runtime_error("learned features need the ONNX file of their network (--model)");
    const std::string bytes = readFile(path, kLargestFile_bytes);
    checksum_ = crc32Of(bytes);
    if (checksum && *checksum != checksum_) {
      throw std::runtime_error("its CRC-32 " + checksum_ +
                               " is not that of the model that the map's features were made with, " +
                               oneLine(*checksum, 20));
    }
    tryInCopy(bytes);
    load(bytes);
  } catch (const std::exception& error) {
    throw ParameterError(name_ + inWords(error));
  }
}

/// Each file once: the threads of a program have the same one. A map's checksum is its author's, and no proof.
void FeatureModel::tryInCopy(const std::string& bytes) {
  constexpr unsigned kLongest_s = 60;
  // ALIKE-s takes a tenth; the largest file half, since OpenCV copies it until the network runs.
  constexpr std::size_t kMost_bytes = std::size_t{2} << 30U;
  static std::mutex mutex;
  static std::set<std::string> harmless;
  const std::lock_guard<std::mutex> lock(mutex);
  if (harmless.count(checksum_) != 0) return;
  const auto try_it = [&] {
    try {
      load(bytes);
      forward(cv::Mat::zeros(480, 640, CV_8U));
    } catch (const std::exception& error) {
      throw std::runtime_error(inWords(error));
    }
  };
  const std::string end = howCopyEnds(try_it, kLongest_s, kMost_bytes);
  if (!end.empty()) throw std::runtime_error("is damaged: OpenCV " CV_VERSION " ends " + end);
  harmless.insert(checksum_);
}

void FeatureModel::load(const std::string& bytes) {
  net_ = cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
  names_ = outputsOf(net_);
  for (const int width_px : {2 * kStride_px, 3 * kStride_px}) {
    cv::Mat ramp(2 * kStride_px, width_px, CV_8U);
    for (int row = 0; row < ramp.rows; ++row) ramp.row(row).setTo(cv::Scalar(2 * row));
    forward(ramp);
  }
}

void FeatureModel::setImage(const cv::Mat& grey) {
  const Silence silence;
  try {
    forward(grey);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw std::runtime_error(name_ + inWords(error));
  }
}

void FeatureModel::forward(const cv::Mat& grey) {
  const auto padding = [](int side_px) { return (kStride_px - side_px % kStride_px) % kStride_px; };
  cv::copyMakeBorder(grey, padded_, 0, padding(grey.rows), 0, padding(grey.cols), cv::BORDER_REPLICATE);
  net_.setInput(cv::dnn::blobFromImage(padded_, 1.0 / 255.0));
  net_.forward(outputs_, names_);
  const cv::Mat& scores = outputs_.front();
  if (!isPlane(scores) || scores.size[1] != 1 || scores.size[2] != padded_.rows || scores.size[3] != padded_.cols) {
    throw std::runtime_error("its output 'scores' is not 1 x 1 x height x width of the image");
  }
  scores_ = cv::Mat(padded_.rows, padded_.cols, CV_32F,
                    const_cast<float*>(scores.ptr<float>()))(cv::Rect(0, 0, grey.cols, grey.rows));
  if (!cv::checkRange(scores_)) throw std::runtime_error("its output 'scores' is not finite");
  levels_.clear();
  Eigen::Index channels = 0;
  for (std::size_t i = 1; i + 1 < outputs_.size(); ++i) {
    const cv::Mat& output = outputs_[i];
    if (!isPlane(output))
      throw std::runtime_error("its output '" + names_[i] + "' is not 1 x channels x height x width");
    levels_.push_back({output.ptr<float>(), output.size[1], output.size[2], output.size[3]});
    channels += output.size[1];
  }
  channels_.resize(channels);
  if (head_.size() == 0) takeHead();
}

/// The same for all images.
void FeatureModel::takeHead() {
  const cv::Mat& output = outputs_.back();
  const std::size_t channels = static_cast<std::size_t>(channels_.size());
  const std::size_t dimension = output.type() == CV_32F ? output.total() / channels : 0;
  if (dimension == 0 || dimension > kLargestDimension || dimension * channels != output.total()) {
    throw std::runtime_error("its output 'head' has " + std::to_string(output.total()) + " numbers, not one to " +
                             std::to_string(kLargestDimension) + " rows of " + std::to_string(channels));
  }
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  head_ = Eigen::Map<const RowMajor>(output.ptr<float>(), static_cast<Eigen::Index>(dimension),
                                     static_cast<Eigen::Index>(channels));
  if (!head_.allFinite()) throw std::runtime_error("its output 'head' is not finite");
}

/// Bilinear; x, y: in pixels of the level.
void FeatureModel::sample(const Level& level, double x, double y, float* to) const {
  const int left = std::clamp(static_cast<int>(x), 0, std::max(0, level.width - 2));
  const int top = std::clamp(static_cast<int>(y), 0, std::max(0, level.height - 2));
  const auto right = static_cast<float>(std::clamp(x - left, 0.0, 1.0));
  const auto down = static_cast<float>(std::clamp(y - top, 0.0, 1.0));
  const int next_column = level.width > 1 ? 1 : 0;
  const int next_row = level.height > 1 ? level.width : 0;
  const std::size_t plane = static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height);
  const float* at = level.values + static_cast<std::ptrdiff_t>(top) * level.width + left;
  for (int channel = 0; channel < level.channels; ++channel, at += plane) {
    const float upper = at[0] + right * (at[next_column] - at[0]);
    const float lower = at[next_row] + right * (at[next_row + next_column] - at[next_row]);
    to[channel] = upper + down * (lower - upper);
  }
}

void FeatureModel::describe(float x_px, float y_px, Eigen::VectorXf& descriptor) {
  float* to = channels_.data();
  for (const Level& level : levels_) {
    // The corners of image and level lie on each other.
    const double x = static_cast<double>(x_px) * (level.width - 1) / (padded_.cols - 1);
    const double y = static_cast<double>(y_px) * (level.height - 1) / (padded_.rows - 1);
    sample(level, x, y, to);
    to += level.channels;
  }
  descriptor.noalias() = head_ * channels_;
  const float length = descriptor.norm();
  if (length > 0.0F && std::isfinite(length)) {
    descriptor /= length;
  } else {
    descriptor.setZero();
  }
}

}  // namespace visual_localization
