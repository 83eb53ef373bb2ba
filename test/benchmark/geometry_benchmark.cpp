// Landmarks and poses of a session, by its number of images: time should grow as it does.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include "test/support/landmark_world.h"

namespace visual_localization {
namespace {

constexpr double kFixNoise_m = 0.15;
constexpr double kDensity = 5.0;  ///< points for a metre of street

double peakMemory_MiB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void adjustStreet(benchmark::State& state) {
  std::mt19937 random(1);
  test::StreetDrive street;
  street.images = static_cast<std::size_t>(state.range(0));
  const auto poses = test::drive(street);
  const test::RecordedDrive drive =
      test::record(poses, test::pointsAlong(poses, kDensity, random), kFixNoise_m, random);
  const UnadjustedSession session = drive.unadjusted();
  const double before_MiB = peakMemory_MiB();
  SessionGeometry geometry;
  for (auto _ : state) geometry = adjustSessions({session}, {}, 1).front();
  std::vector<Eigen::Vector2d> positions_m;
  for (std::size_t i = 0; i < geometry.images.size(); ++i) {
    positions_m.emplace_back(geometry.images[i] ? geometry.images[i]->camera.position_m.head<2>()
                                                : Eigen::Vector2d(session.images[i].position_m));
  }
  state.counters["located"] = static_cast<double>(geometry.located);
  state.counters["sightings"] = static_cast<double>(geometry.sightings);
  state.counters["error_m"] = test::pathError_m(positions_m, drive.truth);
  state.counters["MiB"] = peakMemory_MiB() - before_MiB;
  state.counters["per_image"] = benchmark::Counter(
      static_cast<double>(state.range(0)), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

BENCHMARK(adjustStreet)->Arg(100)->Arg(400)->Arg(1600)->Arg(6400)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace visual_localization
