// Global features of 320 x 240 pixels: ours, and the same quantities from OpenCV's building blocks.
#include <cmath>

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "features/global_histograms.h"
#include "visual_localization/features/global_features.h"

namespace visual_localization::benchmarks {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Blurred noise: gradients in all directions, as in an image of foliage and walls.
cv::Mat texture() {
  cv::Mat image(240, 320, CV_8UC1);
  cv::RNG random(7);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {0, 0}, 2.0);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  return image;
}

void wgoh(benchmark::State& state) {
  const cv::Mat image = texture();
  Wgoh extractor;
  for (auto _ : state) benchmark::DoNotOptimize(extractor.extract(image));
}

void wgii(benchmark::State& state) {
  const cv::Mat image = texture();
  Wgii extractor;
  for (auto _ : state) benchmark::DoNotOptimize(extractor.extract(image));
}

void bothHistograms(benchmark::State& state) {
  const cv::Mat image = texture();
  GlobalExtractor extractor;
  for (auto _ : state) benchmark::DoNotOptimize(extractor.extract(image));
}

/// Without weights and histograms.
void opencvGradients(benchmark::State& state) {
  const cv::Mat image = texture();
  cv::setNumThreads(1);
  cv::Mat dx, dy, magnitude, angle;
  const cv::Mat centre = (cv::Mat_<float>(1, 3) << -1, 0, 1);
  for (auto _ : state) {
    cv::filter2D(image, dx, CV_32F, centre);
    cv::filter2D(image, dy, CV_32F, centre.t());
    cv::cartToPolar(dx, dy, magnitude, angle);
    benchmark::DoNotOptimize(angle.data);
  }
}

/// Ten rotations by shifted images, without weights and histograms.
void opencvInvariants(benchmark::State& state) {
  cv::Mat image;
  texture().convertTo(image, CV_32F, 1.0 / 255.0);
  cv::setNumThreads(1);
  cv::Mat one, two, difference;
  for (auto _ : state) {
    cv::Mat sum = cv::Mat::zeros(image.size(), CV_32F);
    for (int rotation = 0; rotation < 10; ++rotation) {
      const double angle = 2.0 * kPi * rotation / 10.0;
      const auto shifted = [&](double x, double y, cv::Mat& result) {
        const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, std::cos(angle) * x - std::sin(angle) * y, 0, 1,
                               std::sin(angle) * x + std::cos(angle) * y);
        cv::warpAffine(image, result, shift, image.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
      };
      shifted(10.0, 0.0, one);
      shifted(0.0, 20.0, two);
      cv::subtract(one, two, difference);
      // rel(d) = 1 below -eps, 0 above eps, a straight line between.
      difference.convertTo(difference, CV_32F, -0.5 / 0.098, 0.5);
      cv::max(difference, 0.0, difference);
      cv::min(difference, 1.0, difference);
      sum += difference;
    }
    benchmark::DoNotOptimize(sum.data);
  }
}

void compareGlobal(benchmark::State& state) {
  GlobalExtractor extractor;
  const GlobalFeatures a = extractor.extract(texture());
  const GlobalFeatures b = extractor.extract(255 - texture());
  for (auto _ : state) {
    benchmark::DoNotOptimize(histogramIntersection(a.wgoh, b.wgoh) * histogramIntersection(a.wgii, b.wgii));
  }
}

BENCHMARK(wgoh)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencvGradients)->Unit(benchmark::kMicrosecond);
BENCHMARK(wgii)->Unit(benchmark::kMicrosecond);
BENCHMARK(opencvInvariants)->Unit(benchmark::kMicrosecond);
BENCHMARK(bothHistograms)->Unit(benchmark::kMicrosecond);
BENCHMARK(compareGlobal)->Unit(benchmark::kNanosecond);

}  // namespace
}  // namespace visual_localization::benchmarks
