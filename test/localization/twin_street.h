#pragma once

#include <algorithm>
#include <cmath>
#include <memory>

#include "localization/image_likelihood.h"
#include "localization/session_choice.h"
#include "test/support/world.h"

namespace visual_localization::test {

constexpr double kTwin_m = 100.0;  ///< from a place of the first row to its twin in the second

/// A straight street with an image a metre. From 20 to 60 m it looks as it does 100 m further on, almost, and as it
/// does 200 m further on if there are two twins: what is seen there matches its own place by `own` and its twins by
/// `twin`.
class TwinStreet {
 public:
  TwinStreet(double own, double twin, int twins = 1)
      : twins_(twins),
        map_(test::mapAt(test::street(100 + 100 * static_cast<std::size_t>(twins), 1.0))),
        scores_(map_->size()),
        sweep_(*map_, 100000, 100000),
        sessions_(*map_, false) {
    setLikeness(own, twin);
  }

  static Eigen::Vector2d at(double along_m) { return {along_m, 0.0}; }

  void setLikeness(double own, double twin) {
    own_ = own;
    twin_ = twin;
  }

  /// Within this distance an image matches as well as at its place.
  void setPlateau(double plateau_m) { plateau_m_ = plateau_m; }

  Seen from(double along_m) {
    scores_.startImage(FeatureKind::kLocal, [this, along_m](FeatureKind kind, std::size_t image) {
      const double wide_m = kind == FeatureKind::kLocal ? 2.0 : 5.0;
      const double place_m = map_->position_m(image).x();
      const bool twins = along_m >= 20.0 && along_m < 60.0;
      double like = (twins ? own_ : 1.0) * bell(place_m - along_m, wide_m);
      for (int k = 1; twins && k <= twins_; ++k) {
        like = std::max(like, twin_ * bell(place_m - along_m - k * kTwin_m, wide_m));
      }
      return World::scoreAt(0.5 * like);
    });
    sweep_.startImage();
    return {*map_, scores_, likelihood_};
  }

  Seen nowhere() { return from(-1000.0); }

  const TrainingMap& map() const { return *map_; }

 private:
  double bell(double apart_m, double width_m) const {
    const double beyond_m = std::max(0.0, std::abs(apart_m) - plateau_m_);
    return std::exp(-0.5 * beyond_m * beyond_m / (width_m * width_m));
  }

  double own_ = 1.0;
  double twin_ = 1.0;
  double plateau_m_ = 0.0;
  int twins_;
  std::shared_ptr<const TrainingMap> map_;
  Scores scores_;
  MapSweep sweep_;
  SessionChoice sessions_;
  ImageLikelihood likelihood_{scores_, sweep_, sessions_, LocalizerConfig()};
};

inline TrackerConfig severalSwarms(int swarms = 3) {
  TrackerConfig config;
  config.tracker = "dpso_multi";
  config.dpso.swarms = swarms;
  return config;
}

}  // namespace visual_localization::test
