#pragma once

#include <cstddef>
#include <vector>

namespace visual_localization {

/// Whether the calibration of a live camera is right: each image whose pose is solved from landmarks also says which
/// focal length it would rather have. A wrong one bends poses by decimetres before it prevents them.
class FocalCheck {
 public:
  /// `max_error`: of the focal length, as a share of the calibration's.
  explicit FocalCheck(double max_error) : max_error_(max_error) {}

  void configure(double max_error) { max_error_ = max_error; }
  void reset() { images_.clear(); }
  /// What an image says: the focal length as a share of the calibration's, and its standard deviation.
  void add(double scale, double sigma);

  /// The last images agree with the calibration, and are sure of it.
  bool confirms() const;
  /// They do not agree with it.
  bool contradicts() const;
  /// Mean of the last images, weighted; 1 without any.
  double scale() const;

 private:
  struct Image {
    double scale;
    double weight;
  };

  double sigma() const;

  double max_error_;
  std::vector<Image> images_;  ///< the last ones
};

}  // namespace visual_localization
