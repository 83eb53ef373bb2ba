#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <vector>

#include <opencv2/core.hpp>

namespace visual_localization {

/// Width and height of the smallest image that features are extracted from.
constexpr int kSmallestImageSide_px = 16;

/// No image has more local features: far more than one with structure has, and few enough that dense noise, with four
/// features per 1000 pixels, is matched in a second or two; time grows with the square.
constexpr int kMostLocalFeatures = 20000;

/// Whether the image is 8-bit with one channel and large enough.
bool isExtractable(const cv::Mat& grey);
/// Throws std::invalid_argument, naming what is wrong, unless it is.
void requireExtractable(const cv::Mat& grey);

/// Where a local feature was found.
struct Keypoint {
  float x_px = 0.0F;       ///< image column, 0 = centre of the leftmost pixel
  float y_px = 0.0F;       ///< image row, 0 = centre of the top pixel
  float size_px = 0.0F;    ///< diameter of the described neighbourhood
  float angle_deg = 0.0F;  ///< its orientation, [0, 360), clockwise in the image
};

/// The keypoints of an image, one array for each quantity.
class Keypoints {
 public:
  Keypoints() = default;
  Keypoints(const std::vector<Keypoint>& keypoints) {
    for (const Keypoint& keypoint : keypoints) push_back(keypoint);
  }
  Keypoints(std::initializer_list<Keypoint> keypoints) : Keypoints(std::vector<Keypoint>(keypoints)) {}

  std::size_t size() const { return x_px_.size(); }
  bool empty() const { return x_px_.empty(); }
  Keypoint operator[](std::size_t i) const { return {x_px_[i], y_px_[i], size_px_[i], angle_deg_[i]}; }
  const std::vector<float>& x_px() const { return x_px_; }
  const std::vector<float>& y_px() const { return y_px_; }
  const std::vector<float>& size_px() const { return size_px_; }
  const std::vector<float>& angle_deg() const { return angle_deg_; }

  /// Yields each keypoint by value.
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = Keypoint;
    using difference_type = std::ptrdiff_t;
    using pointer = const Keypoint*;
    using reference = Keypoint;

    Iterator(const Keypoints& keypoints, std::size_t i) : keypoints_(&keypoints), i_(i) {}
    Keypoint operator*() const { return (*keypoints_)[i_]; }
    Iterator& operator++() {
      ++i_;
      return *this;
    }
    bool operator==(const Iterator& other) const { return i_ == other.i_; }
    bool operator!=(const Iterator& other) const { return i_ != other.i_; }

   private:
    const Keypoints* keypoints_;
    std::size_t i_;
  };
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size()}; }

  void clear();
  void reserve(std::size_t count);
  void push_back(const Keypoint& keypoint);
  std::vector<Keypoint> list() const { return {begin(), end()}; }
  friend bool operator==(const Keypoints& a, const Keypoints& b) {
    return a.x_px_ == b.x_px_ && a.y_px_ == b.y_px_ && a.size_px_ == b.size_px_ && a.angle_deg_ == b.angle_deg_;
  }

 private:
  std::vector<float> x_px_;
  std::vector<float> y_px_;
  std::vector<float> size_px_;
  std::vector<float> angle_deg_;
};

/// What the elements of a descriptor are.
enum class DescriptorElement : std::uint8_t { kByte, kFloat };

/// The form of a descriptor.
struct DescriptorForm {
  DescriptorElement element = DescriptorElement::kByte;
  std::size_t dimension = 0;

  /// Of one descriptor in memory.
  std::size_t bytes() const { return dimension * (element == DescriptorElement::kByte ? 1 : sizeof(float)); }
  friend bool operator==(const DescriptorForm& a, const DescriptorForm& b) {
    return a.element == b.element && a.dimension == b.dimension;
  }
};

/// The local features of one image, of any kind: n keypoints and n descriptors of bytes or of floats, index by index.
class LocalFeatures {
 public:
  LocalFeatures() = default;
  /// As many elements for each keypoint, row by row; throws std::invalid_argument otherwise.
  LocalFeatures(Keypoints keypoints, std::vector<std::uint8_t> descriptors);
  LocalFeatures(Keypoints keypoints, std::vector<float> descriptors);

  /// Takes these instead of its own, which are left in their place: whoever makes features again and again uses the
  /// same memory. Throws like the constructor, and then nothing has changed.
  void swapIn(Keypoints& keypoints, std::vector<std::uint8_t>& descriptors);
  void swapIn(Keypoints& keypoints, std::vector<float>& descriptors);

  std::size_t size() const { return keypoints_.size(); }
  bool empty() const { return keypoints_.empty(); }
  const Keypoints& keypoints() const { return keypoints_; }
  /// Of dimension 0 while there is no feature.
  const DescriptorForm& form() const { return form_; }
  /// All descriptors, row by row; empty when they are of the other element.
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  const std::vector<float>& floats() const { return floats_; }
  /// Descriptor i.
  const std::uint8_t* bytes(std::size_t i) const { return bytes_.data() + i * form_.dimension; }
  const float* floats(std::size_t i) const { return floats_.data() + i * form_.dimension; }
  /// 1 / |descriptor i|; 0 for the zero vector.
  float inverseNorm(std::size_t i) const { return inverse_norms_[i]; }
  /// What it takes in memory.
  std::size_t memory_bytes() const;

  /// The features at `indices`, in that order.
  LocalFeatures subset(const std::vector<std::size_t>& indices) const;
  /// The same into `chosen`, another object, whose memory is used again.
  void subset(const std::vector<std::size_t>& indices, LocalFeatures& chosen) const;

 private:
  template <class Element>
  void swapIn(Keypoints& keypoints, std::vector<Element>& descriptors, std::vector<Element>& own,
              DescriptorElement element);

  Keypoints keypoints_;
  DescriptorForm form_;
  std::vector<std::uint8_t> bytes_;
  std::vector<float> floats_;
  std::vector<float> inverse_norms_;
};

/// Image in, local features out. Not thread-safe: one extractor a thread.
class LocalExtractor {
 public:
  virtual ~LocalExtractor() = default;
  /// Throws like requireExtractable.
  LocalFeatures extract(const cv::Mat& grey) {
    LocalFeatures features;
    extract(grey, features);
    return features;
  }
  /// The same into `features`, whose memory is used again.
  virtual void extract(const cv::Mat& grey, LocalFeatures& features) = 0;
};

}  // namespace visual_localization
