#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>

namespace visual_localization {

/// `N` different ones of `count` >= N indices, each as probable.
template <std::size_t N, class Engine>
std::array<std::size_t, N> drawDistinct(std::size_t count, Engine& engine) {
  std::uniform_int_distribution<std::size_t> any(0, count - 1);
  std::array<std::size_t, N> drawn{};
  for (auto next = drawn.begin(); next != drawn.end(); ++next) {
    do *next = any(engine);
    while (std::find(drawn.begin(), next, *next) != next);
  }
  return drawn;
}

/// How many samples of `size` matches find one without an outlier with a probability of 99.9 %, when `inlier_share` of
/// all are inliers (Fischler and Bolles 1981): between `least` and `most`.
inline int samplesNeeded(double inlier_share, int size, int least, int most) {
  constexpr double kMissed = 0.001;
  double clean_share = 1.0;
  for (int i = 0; i < size; ++i) clean_share *= inlier_share;
  if (!(clean_share > 0.0)) return most;
  return static_cast<int>(std::clamp<double>(std::ceil(std::log(kMissed) / std::log1p(-clean_share)), least, most));
}

}  // namespace visual_localization
