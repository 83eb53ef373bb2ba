// What changes a localizer between two images.

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "test/localization/localizer_fixture.h"
#include "test/support/swarm_config.h"

namespace visual_localization {
namespace {

using LocalizerChanges = test::LocalizerTest;

TEST_F(LocalizerChanges, ReconfiguringChangesTrackerAndParticles) {
  settle();
  LocalizerConfig config = test::swarmConfig();
  config.dpso.particles = 30;
  localizer_->configure(config);
  EXPECT_EQ(localizer_->particles().size(), 30U);
  int near = 0;
  for (const Particle& particle : localizer_->particles())
    near += std::abs(particle.position_m.x() - 20.0) < 12.0 ? 1 : 0;
  EXPECT_GT(near, 20) << "drawn from those before";
  config.dpso.quantum_share = 0.2;
  localizer_->configure(config);
  int quantum = 0;
  for (const Particle& particle : localizer_->particles()) quantum += particle.kind == ParticleKind::kQuantum ? 1 : 0;
  EXPECT_EQ(quantum, 6);
  config.tracker = "pf_linear";
  localizer_->configure(config);
  EXPECT_EQ(localizer_->particles().size(), static_cast<std::size_t>(config.pf.particles));
  config.tracker = "dpso";
  config.dpso.particles = config.pf.particles;  // as many, and yet another tracker
  localizer_->configure(config);
  quantum = 0;
  for (const Particle& particle : localizer_->particles()) quantum += particle.kind == ParticleKind::kQuantum ? 1 : 0;
  EXPECT_EQ(quantum, config.dpso.particles / 5);
  config.sweep_images = 10;
  config.features = "global";
  localizer_->configure(config);
  EXPECT_EQ(see(20.0).evidence.features, FeatureKind::kGlobal);
}

TEST_F(LocalizerChanges, RelocalizingSpreadsTheParticles) {
  settle();
  const auto reach_m = [this] {
    double farthest_m = 0.0;
    for (const Particle& particle : localizer_->particles()) {
      farthest_m = std::max(farthest_m, std::abs(particle.position_m.x() - 20.0));
    }
    return farthest_m;
  };
  localizer_->relocalize(around({20.0, 0.0}, 3.0));
  EXPECT_LE(reach_m(), 3.0);
  localizer_->relocalize();
  EXPECT_GT(reach_m(), 30.0);
  image_->best = 0.0;
  EXPECT_EQ(see(20.0).state, LocalizationState::kInitializing) << "what confirmed it before is forgotten";
}

TEST_F(LocalizerChanges, ReconfiguringReachesStateAndSweep) {
  settle();
  LocalizerConfig strict = test::swarmConfig();
  strict.state.min_similarity = 0.9;
  localizer_->configure(strict);
  Estimate estimate;
  for (int i = 0; i < 10; ++i) estimate = see(20.0);
  EXPECT_NE(estimate.state, LocalizationState::kTracking) << "0.5 is not enough any more";
  LocalizerConfig few = test::swarmConfig();
  few.sweep_images = 10;
  few.state.sure_similarity = 1.0;
  localizer_->configure(few);
  const std::size_t swept = see(20.0).swept;
  few.sweep_images = 20000;
  localizer_->configure(few);
  EXPECT_GT(see(20.0).swept, swept);
}

TEST_F(LocalizerChanges, AnImageThatFailedIsLookedAtAnewWhenItRepeats) {
  settle();
  image_->fails = true;
  EXPECT_THROW(see(25.0), std::runtime_error);
  image_->fails = false;
  image_->repeated = true;
  const int compared = image_->compared;
  see(25.0, 0.0);
  EXPECT_GT(image_->compared, compared) << "and does not get the answer of the one before";
}

TEST_F(LocalizerChanges, WhatIsToldMeanwhileIsNewsToARepeatedImage) {
  settle();
  image_->repeated = true;
  int compared = image_->compared;
  see(20.0, 0.0);
  EXPECT_EQ(image_->compared, compared);
  localizer_->configure({});
  see(20.0, 0.0);
  EXPECT_GT(image_->compared, compared) << "other parameters";
  compared = image_->compared;
  see(20.0, 0.0);
  EXPECT_EQ(image_->compared, compared);
  localizer_->setMount({});
  see(20.0, 0.0);
  EXPECT_GT(image_->compared, compared) << "another mount";
  Intrinsics lens;
  lens.size = {320, 240};
  lens.fx = lens.fy = 300.0;
  lens.cx = 160.0;
  lens.cy = 120.0;
  compared = image_->compared;
  localizer_->setCamera(CameraModel(lens));
  see(20.0, 0.0);
  EXPECT_GT(image_->compared, compared) << "another camera";
  compared = image_->compared;
  localizer_->setMask({});
  see(20.0, 0.0);
  EXPECT_GT(image_->compared, compared) << "another mask";
}

}  // namespace
}  // namespace visual_localization
