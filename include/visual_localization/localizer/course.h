#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace visual_localization {

/// The last estimated positions. A robot moves steadily between a few images; an estimate that jumps to and fro does
/// not follow one.
class Course {
 public:
  explicit Course(std::size_t length) : length_(length) {}

  void clear() { points_.clear(); }
  /// `position_m` at an image with this stamp.
  void add(std::int64_t stamp_ns, const Eigen::Vector2d& position_m);
  /// Root mean square distance of the positions from the uniform motion along a straight line that fits them best; 0
  /// with fewer than three of them. By the images' order when their stamps do not rise.
  double residual_m() const;

 private:
  struct Point {
    std::int64_t stamp_ns = 0;
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  };

  bool stampsRise() const;

  std::size_t length_;
  std::vector<Point> points_;
};

}  // namespace visual_localization
