#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/similarity.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// How likely an image was taken at a position: f(x, t), and the training image that it rests on.
struct Fitness {
  double value = 0.0;  ///< not normalised
  std::size_t training_image = 0;
  Score score;
};

/// What is known of where an image was taken, as a function that a tracker asks for the places it is interested in.
/// What it asks for is compared with the image, at most once, and counted; nothing else is.
class Likelihood {
 public:
  virtual ~Likelihood() = default;
  /// Of a position in the map frame.
  virtual Fitness at(const Eigen::Vector2d& position_m) = 0;
  /// Of the position of a training image.
  virtual Score of(std::size_t training_image) = 0;
  /// The only position where it is large, if it is known without asking anywhere. at() agrees with it: a tracker may
  /// go there at once, but need not.
  virtual std::optional<Eigen::Vector2d> peak_m() const { return std::nullopt; }
  /// The training image that the peak rests on, if the image was compared with it.
  virtual std::optional<Fitness> seenAtPeak() const { return std::nullopt; }
  /// A training image where a lost robot may be, in proportion to how alike the whole image looks.
  virtual std::size_t draw(Random& random) = 0;
  /// The `count` training images that look most alike as a whole, the best first.
  virtual std::vector<std::size_t> mostSimilar(std::size_t count) = 0;
};

/// Where landmarks verify that the image was taken: a Gaussian of height one about the pose. Compares nothing.
class PoseLikelihood final : public Likelihood {
 public:
  /// `map` must outlive it.
  PoseLikelihood(const TrainingMap& map, const Eigen::Vector2d& verified_m, const std::optional<Fitness>& seen = {});

  Fitness at(const Eigen::Vector2d& position_m) override;
  Score of(std::size_t training_image) override { return at(map_.position_m(training_image)).score; }
  std::optional<Eigen::Vector2d> peak_m() const override { return verified_m_; }
  std::optional<Fitness> seenAtPeak() const override { return seen_; }
  std::size_t draw(Random&) override { return nearest_; }
  std::vector<std::size_t> mostSimilar(std::size_t count) override;

 private:
  const TrainingMap& map_;
  Eigen::Vector2d verified_m_;
  std::size_t nearest_;  ///< training image
  std::optional<Fitness> seen_;
};

}  // namespace visual_localization
