// Symmetric ratio match of two images' descriptors: ours, the plain loop, and what OpenCV and Eigen offer for it.
#include <vector>

#include <Eigen/Core>
#include <benchmark/benchmark.h>
#include <opencv2/features2d.hpp>
#include <opencv2/flann.hpp>

#include "features/nearest_descriptors.h"
#include "test/benchmark/descriptor_sets.h"
#include "test/support/cpu_targets.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/localization/similarity.h"

namespace visual_localization::benchmarks {
namespace {

constexpr double kRatio = 0.6;

struct Pair {
  LocalFeatures a;
  LocalFeatures b;
};

Pair pairOf(const benchmark::State& state) {
  const auto count = static_cast<std::size_t>(state.range(0));
  LocalFeatures a = randomDescriptors(count, 1);
  LocalFeatures b = overlappingDescriptors(a, count, 0.3, 2);
  return {std::move(a), std::move(b)};
}

/// As float rows, which OpenCV's matchers want.
cv::Mat floatRows(const LocalFeatures& features) {
  cv::Mat bytes(static_cast<int>(features.size()), static_cast<int>(kSiftDimension), CV_8UC1,
                const_cast<std::uint8_t*>(features.bytes().data()));
  cv::Mat rows;
  bytes.convertTo(rows, CV_32F);
  return rows;
}

/// Multiply-accumulates a second; 128 for each pair of descriptors, once for both directions.
void countMacs(benchmark::State& state) {
  const auto pairs = static_cast<double>(state.range(0) * state.range(0));
  state.counters["MAC/s"] = benchmark::Counter(pairs * kSiftDimension, benchmark::Counter::kIsIterationInvariantRate);
}

void symmetricMatch(benchmark::State& state) {
  const Pair pair = pairOf(state);
  for (auto _ : state) benchmark::DoNotOptimize(matchSymmetric(pair.a, pair.b, kRatio));
  countMacs(state);
}

void similarity(benchmark::State& state) {
  const Pair pair = pairOf(state);
  const LocalSimilarity sift{MatchConfig(), SimilarityConfig()};
  for (auto _ : state) benchmark::DoNotOptimize(sift.compare(pair.a, pair.b));
  countMacs(state);
}

void votes(benchmark::State& state) {
  const Pair pair = pairOf(state);
  const LocalSimilarity sift{{kRatio, "votes"}, SimilarityConfig()};
  for (auto _ : state) benchmark::DoNotOptimize(sift.compare(pair.a, pair.b));
  countMacs(state);
}

/// On a CPU that has no more than AVX2.
void votesAvx2(benchmark::State& state) {
  test::useTargets(hwy::SupportedTargets() & ~(HWY_AVX2 - 1));
  votes(state);
  test::useTargets(0);
}

/// With cross-check, without votes.
void opencvMutual(benchmark::State& state) {
  const Pair pair = pairOf(state);
  const cv::Mat a = floatRows(pair.a);
  const cv::Mat b = floatRows(pair.b);
  cv::setNumThreads(1);
  const cv::BFMatcher matcher(cv::NORM_L2, true);
  std::vector<cv::DMatch> matches;
  for (auto _ : state) {
    matcher.match(a, b, matches);
    benchmark::DoNotOptimize(matches.data());
  }
  countMacs(state);
}

void nearest(benchmark::State& state) {
  const Pair pair = pairOf(state);
  NearestDescriptors found;
  for (auto _ : state) {
    findNearest(pair.a, pair.b, found);
    benchmark::DoNotOptimize(found.of_a.data());
    benchmark::ClobberMemory();
  }
  countMacs(state);
}

void nearestPlainLoop(benchmark::State& state) {
  const Pair pair = pairOf(state);
  NearestDescriptors found;
  for (auto _ : state) {
    findNearestPlain(pair.a, pair.b, found);
    benchmark::DoNotOptimize(found.of_a.data());
    benchmark::ClobberMemory();
  }
  countMacs(state);
}

/// Two nearest in both directions, ratio of distances, cross-check.
void opencvMatch(benchmark::State& state, const cv::DescriptorMatcher& matcher) {
  const Pair pair = pairOf(state);
  const cv::Mat a = floatRows(pair.a);
  const cv::Mat b = floatRows(pair.b);
  cv::setNumThreads(1);
  std::vector<std::vector<cv::DMatch>> forward;
  std::vector<std::vector<cv::DMatch>> backward;
  for (auto _ : state) {
    matcher.knnMatch(a, b, forward, 2);
    matcher.knnMatch(b, a, backward, 2);
    int matches = 0;
    for (const auto& found : forward) {
      const auto& back = backward[static_cast<std::size_t>(found[0].trainIdx)];
      const bool distinct = found[0].distance < kRatio * found[1].distance;
      matches += distinct && back[0].trainIdx == found[0].queryIdx && back[0].distance < kRatio * back[1].distance;
    }
    benchmark::DoNotOptimize(matches);
  }
  countMacs(state);
}
void opencvBruteForce(benchmark::State& state) { opencvMatch(state, cv::BFMatcher(cv::NORM_L2)); }
void opencvFlann(benchmark::State& state) { opencvMatch(state, cv::FlannBasedMatcher()); }

void eigenProduct(benchmark::State& state) {
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Pair pair = pairOf(state);
  const auto unitRows = [](const LocalFeatures& features) {
    const cv::Mat rows = floatRows(features);
    Rows result = Eigen::Map<const Rows>(rows.ptr<float>(), rows.rows, rows.cols);
    result.rowwise().normalize();
    return result;
  };
  const Rows a = unitRows(pair.a);
  const Rows b = unitRows(pair.b);
  Rows cosines;
  for (auto _ : state) {
    cosines.noalias() = a * b.transpose();
    Eigen::Array<float, Eigen::Dynamic, 2> of_a(a.rows(), 2);
    Eigen::Array<float, Eigen::Dynamic, 2> of_b(b.rows(), 2);
    of_a.setConstant(-1.0F);
    of_b.setConstant(-1.0F);
    const auto insert = [](auto&& two, float value) {
      two(1) = std::max(two(1), std::min(value, two(0)));
      two(0) = std::max(two(0), value);
    };
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      for (Eigen::Index j = 0; j < b.rows(); ++j) {
        insert(of_a.row(i), cosines(i, j));
        insert(of_b.row(j), cosines(i, j));
      }
    }
    benchmark::DoNotOptimize(of_a.data());
    benchmark::DoNotOptimize(of_b.data());
  }
  countMacs(state);
}

#define FOR_SIZES(function) BENCHMARK(function)->Arg(20)->Arg(100)->Arg(140)->Arg(350)->Unit(benchmark::kMicrosecond)
FOR_SIZES(symmetricMatch);
FOR_SIZES(similarity);
BENCHMARK(votes)->Arg(500)->Arg(600)->Arg(1000)->Unit(benchmark::kMicrosecond);
BENCHMARK(votesAvx2)->Arg(500)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencvMutual)->Arg(500)->Unit(benchmark::kMicrosecond);
FOR_SIZES(nearest);
FOR_SIZES(nearestPlainLoop);
FOR_SIZES(eigenProduct);
FOR_SIZES(opencvBruteForce);
FOR_SIZES(opencvFlann);

}  // namespace
}  // namespace visual_localization::benchmarks
