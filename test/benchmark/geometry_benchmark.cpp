// Landmarks and poses of a session by its number of images, and verification of matches beside OpenCV's.
#include <benchmark/benchmark.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/version.hpp>
#include <sys/resource.h>

#include "geometry/relative_rotation.h"
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
  state.counters["observations"] = static_cast<double>(geometry.observations);
  state.counters["error_m"] = test::pathError_m(positions_m, drive.truth);
  state.counters["MiB"] = peakMemory_MiB() - before_MiB;
  state.counters["per_image"] = benchmark::Counter(
      static_cast<double>(state.range(0)), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

BENCHMARK(adjustStreet)
    ->Arg(400)
    ->Arg(1600)
    ->Arg(6400)
    ->Arg(10000)
    ->Arg(100000)  // more than 20 minutes
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

constexpr double kPixel = 1.0 / 450.0;

/// 250 matches of a robot that drives 1 m and turns by 0.1 rad, to 0.3 pixels; `wrong_percent` of them lead anywhere.
struct Matches {
  std::vector<Eigen::Vector2d> a;
  std::vector<Eigen::Vector2d> b;
  std::vector<FeatureMatch> all;

  explicit Matches(std::int64_t wrong_percent) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> side(-0.6, 0.6);
    std::uniform_real_distribution<double> depth_m(4.0, 25.0);
    std::normal_distribution<double> noise(0.0, 0.3 * kPixel);
    const CameraPose b_in_a = {Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY())), {0.1, 0.0, 1.0}};
    const auto at = [&](auto& distribution) {
      const double x = distribution(random);
      return Eigen::Vector2d(x, distribution(random));
    };
    for (std::uint32_t i = 0; i < 250; ++i) {
      const Eigen::Vector3d point = depth_m(random) * at(side).homogeneous();
      a.emplace_back(point.hnormalized() + at(noise));
      const bool is_wrong = std::int64_t{i} * 100 < wrong_percent * 250;
      b.push_back(is_wrong ? at(side) : b_in_a.toCamera(point).hnormalized() + at(noise));
      all.push_back({i, i});
    }
  }
};

void verifyMatches(benchmark::State& state) {
  const Matches matches(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(verifyTwoViews(matches.a, matches.b, matches.all, kPixel, 15, 0.6));
  }
}
BENCHMARK(verifyMatches)->Arg(0)->Arg(30)->Arg(60)->Unit(benchmark::kMillisecond);

#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 5
void verifyMatchesByOpenCv(benchmark::State& state) {
  const Matches matches(state.range(0));
  std::vector<cv::Point2d> a;
  std::vector<cv::Point2d> b;
  for (const Eigen::Vector2d& point : matches.a) a.emplace_back(point.x(), point.y());
  for (const Eigen::Vector2d& point : matches.b) b.emplace_back(point.x(), point.y());
  cv::Mat inliers;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        cv::findEssentialMat(a, b, cv::Mat::eye(3, 3, CV_64F), cv::USAC_MAGSAC, 0.999, kPixel, inliers));
  }
}
BENCHMARK(verifyMatchesByOpenCv)->Arg(0)->Arg(30)->Arg(60)->Unit(benchmark::kMillisecond);
#endif

}  // namespace
}  // namespace visual_localization
