// Without comparisons: all scores are at hand.
#include <memory>

#include <benchmark/benchmark.h>

#include "localization/papers/dpso.h"
#include "localization/papers/particle_filter.h"
#include "test/support/world.h"

namespace visual_localization::benchmarks {
namespace {

/// A robot that goes around the circle, 0.94 m an image.
template <class MakeTracker>
void step(benchmark::State& state, MakeTracker makeTracker) {
  test::World world = test::roundWorld();
  const std::unique_ptr<Tracker> tracker = makeTracker(world.map(), static_cast<int>(state.range(0)));
  double arc_m = 0.0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(see(*tracker, world.from(test::onCircle(arc_m))));
    arc_m += 0.94;
  }
}

void dpso(benchmark::State& state) {
  step(state, [](const TrainingMap& map, int particles) {
    DpsoConfig config;
    config.particles = particles;
    return std::make_unique<Dpso>(map, config, 1);
  });
}

void filter(benchmark::State& state, const std::string& motion) {
  step(state, [&motion](const TrainingMap& map, int particles) {
    ParticleFilterConfig config;
    config.particles = particles;
    return std::make_unique<ParticleFilter>(map, makeMotionModel(motion, config, map), config, 1);
  });
}
void particleFilterGaussian(benchmark::State& state) { filter(state, "pf_gaussian"); }
void particleFilterLinear(benchmark::State& state) { filter(state, "pf_linear"); }

BENCHMARK(dpso)->Arg(40)->Arg(80)->Arg(120)->Unit(benchmark::kMicrosecond);
BENCHMARK(particleFilterGaussian)->Arg(100)->Arg(300)->Unit(benchmark::kMicrosecond);
BENCHMARK(particleFilterLinear)->Arg(100)->Arg(300)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace visual_localization::benchmarks
