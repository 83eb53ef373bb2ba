#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
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

/// How well matches agree with a model.
struct Support {
  std::size_t inliers = 0;
  double score = 0.0;  ///< less for a match that is farther off (Geman and McClure 1987)
};

/// The model with the best support among those that samples of the matches allow (RANSAC, Fischler and Bolles 1981),
/// each new best one improved at once by its inliers (Chum, Matas and Kittler 2003). The same for the same matches.
///
/// An `Estimator` has a type `Model`, the constants kSampleSize, kLeastSamples and kMostSamples, and
///   count()                         the number of matches, at least kSampleSize
///   modelsOf(sample, random)        those that kSampleSize matches, given as indices, allow
///   supportOf(model)
///   improve(best, random, keep)     offers better models to `keep`, which tells whether one was and then is `best`
template <class Estimator>
std::optional<typename Estimator::Model> mostSupported(const Estimator& estimator) {
  using Model = typename Estimator::Model;
  std::minstd_rand random;
  std::optional<Model> best;
  Support most;
  const auto keep = [&](const Model& model) {
    const Support support = estimator.supportOf(model);
    if (!(support.score > most.score)) return false;
    best = model;
    most = support;
    return true;
  };
  int samples = Estimator::kMostSamples;
  for (int i = 0; i < samples; ++i) {
    for (const Model& model :
         estimator.modelsOf(drawDistinct<Estimator::kSampleSize>(estimator.count(), random), random)) {
      if (!keep(model)) continue;
      estimator.improve(*best, random, keep);
      const double share = static_cast<double>(most.inliers) / static_cast<double>(estimator.count());
      samples = samplesNeeded(share, static_cast<int>(Estimator::kSampleSize), Estimator::kLeastSamples,
                              Estimator::kMostSamples);
    }
  }
  return best;
}

}  // namespace visual_localization
