// From an image to a pose, on the rounds that ship: images of the cloudy round, again and again, in the map of the
// sunny one. Beside it OpenCV's extraction alone.
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/features2d.hpp>

#include "evaluation/round_recorder.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

constexpr std::size_t kImages = 100;
constexpr const char* kTopic = "/stereo/left/image_raw";

struct Scene {
  std::shared_ptr<const TrainingMap> map;        ///< by the package's defaults
  std::shared_ptr<const TrainingMap> paper_map;  ///< by the preset "paper"
  std::vector<cv::Mat> images;
};

std::shared_ptr<const TrainingMap> mapBy(const std::string& preset) {
  const RoundSpec round{"map", "", "", kTopic, "/gps/fix", "/ground_truth/fix", "", ""};
  MapBuilderConfig config;
  assignParameters(config, mapBuilderValues({{"preset", preset}}));
  return recordMap(TEST_DATA_DIR "/rounds/campus_sunny_1.bag", round, config);
}

const Scene& scene() {
  static const Scene recorded = [] {
    cv::setNumThreads(1);
    Scene made{mapBy(""), mapBy("paper"), {}};
    const BagReader bag(TEST_DATA_DIR "/rounds/campus_cloudy_1.bag");
    const BagImages images = bag.images(kTopic);
    for (std::size_t i = 0; i < kImages; ++i) made.images.push_back(images.read(i).decode());
    return made;
  }();
  return recorded;
}

/// To and fro, so that the robot never jumps.
const cv::Mat& imageAt(std::size_t at) {
  const std::size_t place = at % (2 * kImages);
  return scene().images[place < kImages ? place : 2 * kImages - 1 - place];
}

void localize(benchmark::State& state, const ParameterValues& given) {
  LocalizerConfig config;
  assignParameters(config, localizerValues(given));
  Localizer localizer(config.preset.empty() ? scene().map : scene().paper_map, config);
  std::size_t at = 0;
  double extract_ms = 0.0;
  double match_ms = 0.0;
  double update_ms = 0.0;
  for (; at < kImages; ++at) localizer.process(static_cast<std::int64_t>(at) * 1000000000, imageAt(at));
  for (auto _ : state) {
    const Estimate estimate = localizer.process(static_cast<std::int64_t>(at) * 1000000000, imageAt(at));
    ++at;
    extract_ms += estimate.image.extract_ms;
    match_ms += estimate.image.match_ms;
    update_ms += estimate.update_ms;
  }
  const auto mean = benchmark::Counter::kAvgIterations;
  state.counters["extract_ms"] = benchmark::Counter(extract_ms, mean);
  state.counters["match_ms"] = benchmark::Counter(match_ms, mean);
  state.counters["update_ms"] = benchmark::Counter(update_ms, mean);
}

void landmarks(benchmark::State& state) { localize(state, {}); }
void places(benchmark::State& state) { localize(state, {{"pose_source", std::string("place")}}); }

void paperDpso80(benchmark::State& state, const std::string& features) {
  localize(state, {{"preset", std::string("paper")}, {"features", features}});
}

void opencvExtractionAlone(benchmark::State& state) {
  cv::setNumThreads(1);
  const cv::Ptr<cv::SIFT> sift = cv::SIFT::create(0, 3, 0.04, 10, 1.6, CV_8U);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  std::size_t at = 0;
  for (auto _ : state) {
    sift->detectAndCompute(imageAt(at++), cv::noArray(), keypoints, descriptors);
    benchmark::DoNotOptimize(descriptors.data);
  }
}

BENCHMARK(opencvExtractionAlone)->Unit(benchmark::kMillisecond);
BENCHMARK(landmarks)->Unit(benchmark::kMillisecond);
BENCHMARK(places)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(paperDpso80, sift, std::string("sift"))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(paperDpso80, hybrid, std::string("hybrid"))->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(paperDpso80, global, std::string("global"))->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace visual_localization
