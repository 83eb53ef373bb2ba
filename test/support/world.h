#pragma once

#include <cmath>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "test/support/synthetic.h"
#include "visual_localization/similarity/score_cache.h"
#include "visual_localization/tracking/particle.h"

namespace visual_localization::test {

/// A world without images: how alike two places look depends on their distance only.
class World {
 public:
  explicit World(std::shared_ptr<const TrainingMap> map) : map_(std::move(map)), scores_(map_->size()) {}

  /// What the robot sees from here.
  ScoreCache& from(const Eigen::Vector2d& robot_m) {
    scores_.startImage([this, robot_m](std::size_t image) {
      const double distance = (map_->image(image).position_m - robot_m).norm() / 2.0;
      const double similarity = 0.5 * std::exp(-0.5 * distance * distance);
      return Score{similarity, static_cast<std::size_t>(100.0 * similarity)};
    });
    return scores_;
  }

  ScoreCache& inTheDark() {
    scores_.startImage([](std::size_t) { return Score{}; });
    return scores_;
  }

  const TrainingMap& map() const { return *map_; }

 private:
  std::shared_ptr<const TrainingMap> map_;
  ScoreCache scores_;
};

/// A round of 30 m radius with an image every 0.94 m.
inline World roundWorld() { return World(mapAt(circle(200, 30.0))); }

/// The place `arc_m` along that round.
inline Eigen::Vector2d onCircle(double arc_m) {
  return 30.0 * Eigen::Vector2d(std::cos(arc_m / 30.0), std::sin(arc_m / 30.0));
}

inline double sumOfWeights(const std::vector<Particle>& particles) {
  return std::accumulate(particles.begin(), particles.end(), 0.0,
                         [](double sum, const Particle& particle) { return sum + particle.weight; });
}

}  // namespace visual_localization::test
