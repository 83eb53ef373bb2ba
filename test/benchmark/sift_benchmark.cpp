// SIFT extraction: ours, OpenCV's, and the stages of ours, on a synthetic image, on campus images and on those of the
// folder that VISUAL_LOCALIZATION_IMAGES names. On a machine that has other things to do:
//   benchmark_sift --benchmark_enable_random_interleaving --benchmark_repetitions=20 --benchmark_report_aggregates_only
// and compare the minima.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "features/sift/descriptor.h"
#include "features/sift/extrema.h"
#include "features/sift/scale_space.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

struct NamedImages {
  std::string name;
  std::vector<cv::Mat> images;
};

/// Blocks of all sizes, softened as by a lens.
cv::Mat textured(int width, int height) {
  cv::RNG random(1);
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < width * height / 300; ++i) {
    const int size = 2 + static_cast<int>(std::exp(random.uniform(0.0, 3.5)));
    const cv::Rect block(random.uniform(-10, width), random.uniform(-10, height), size, random.uniform(2, 2 * size));
    cv::rectangle(image, block, cv::Scalar(random.uniform(0, 256)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, {}, 0.8);
  return image;
}

std::vector<cv::Mat> readFolder(const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path().string());
  std::sort(paths.begin(), paths.end());
  std::vector<cv::Mat> images;
  for (const std::string& path : paths) {
    const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE);
    if (!image.empty()) images.push_back(image);
  }
  return images;
}

std::vector<NamedImages> imageSets() {
  std::vector<NamedImages> sets{{"synthetic_320x240", {textured(320, 240)}},
                                {"synthetic_1241x376", {textured(1241, 376)}},
                                {"campus", readFolder(TEST_DATA_DIR "/images")}};
  if (const char* folder = std::getenv("VISUAL_LOCALIZATION_IMAGES")) sets.push_back({"folder", readFolder(folder)});
  return sets;
}

void extractImages(benchmark::State& state, const NamedImages& set,
                   std::unique_ptr<LocalExtractor> (*makeExtractor)(const SiftConfig&)) {
  cv::setNumThreads(1);
  const auto extractor = makeExtractor(SiftConfig());
  std::size_t next = 0;
  std::size_t features = 0;
  for (auto _ : state) features += extractor->extract(set.images[next++ % set.images.size()]).size();
  state.counters["features"] = static_cast<double>(features) / static_cast<double>(next);
}

/// What the stages before a measured one made of an image.
struct Prepared {
  SiftConfig config;
  SiftScaleSpace scale_space{config};
  std::vector<std::vector<SiftExtremum>> extrema;
  std::vector<SiftPoint> refined;
  std::vector<SiftPoint> oriented;

  explicit Prepared(const cv::Mat& image) {
    scale_space.setImage(image);
    SiftExtremaSearch search(config);
    SiftOrientations orientations;
    for (std::size_t i = 0; i < scale_space.octaves(); ++i) {
      makeOctave(i);
      extrema.emplace_back();
      search.begin(scale_space.octave(i).width());
      search.search(scale_space.octave(i), scale_space.octave(i).height(), extrema.back());
    }
    refineAll();
    for (const SiftPoint& point : refined) orientations.assign(levelOf(point), point, oriented);
  }

  void makeOctave(std::size_t i) {
    scale_space.begin(i);
    while (scale_space.advance() < scale_space.octave(i).height()) {
    }
  }
  void refineAll() {
    refined.clear();
    for (std::size_t i = 0; i < extrema.size(); ++i) {
      for (const SiftExtremum& extremum : extrema[i]) {
        const auto point = refine(scale_space.octave(i), static_cast<int>(i), extremum, config);
        if (point) refined.push_back(*point);
      }
    }
  }
  const FloatPlane& levelOf(const SiftPoint& point) const {
    return scale_space.octave(static_cast<std::size_t>(point.octave)).levels[static_cast<std::size_t>(point.level)];
  }
};

void scaleSpace(benchmark::State& state, const NamedImages& set) {
  Prepared prepared(set.images.front());
  for (auto _ : state) {
    prepared.scale_space.setImage(set.images.front());
    for (std::size_t i = 0; i < prepared.scale_space.octaves(); ++i) prepared.makeOctave(i);
  }
}

void extrema(benchmark::State& state, const NamedImages& set) {
  const Prepared prepared(set.images.front());
  SiftExtremaSearch search(prepared.config);
  std::vector<SiftExtremum> found;
  for (auto _ : state) {
    found.clear();
    for (std::size_t i = 0; i < prepared.scale_space.octaves(); ++i) {
      const SiftOctave& octave = prepared.scale_space.octave(i);
      search.begin(octave.width());
      search.search(octave, octave.height(), found);
    }
  }
  state.counters["extrema"] = static_cast<double>(found.size());
}

void refinement(benchmark::State& state, const NamedImages& set) {
  Prepared prepared(set.images.front());
  for (auto _ : state) prepared.refineAll();
  state.counters["points"] = static_cast<double>(prepared.refined.size());
}

void orientation(benchmark::State& state, const NamedImages& set) {
  const Prepared prepared(set.images.front());
  SiftOrientations orientations;
  std::vector<SiftPoint> oriented;
  for (auto _ : state) {
    oriented.clear();
    for (const SiftPoint& point : prepared.refined) orientations.assign(prepared.levelOf(point), point, oriented);
  }
  state.counters["features"] = static_cast<double>(oriented.size());
}

void description(benchmark::State& state, const NamedImages& set) {
  const Prepared prepared(set.images.front());
  SiftDescriber describer;
  std::uint8_t descriptor[kSiftDimension];
  for (auto _ : state) {
    for (const SiftPoint& point : prepared.oriented) {
      describer.describe(prepared.levelOf(point), point, descriptor);
      benchmark::DoNotOptimize(descriptor);
    }
  }
}

double smallest(const std::vector<double>& values) { return *std::min_element(values.begin(), values.end()); }

template <class Function, class... Arguments>
void add(const std::string& name, Function function, const Arguments&... arguments) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) { function(state, arguments...); })
      ->Unit(benchmark::kMillisecond)
      ->ComputeStatistics("min", smallest);
}

const bool registered = [] {
  for (const NamedImages& set : imageSets()) {
    if (set.images.empty()) continue;
    add(set.name + "/opencv", extractImages, set, makeOpenCvSiftExtractor);
    add(set.name + "/native", extractImages, set, makeSiftExtractor);
    add(set.name + "/native/scale_space", scaleSpace, set);
    add(set.name + "/native/extrema", extrema, set);
    add(set.name + "/native/refinement", refinement, set);
    add(set.name + "/native/orientation", orientation, set);
    add(set.name + "/native/description", description, set);
  }
  return true;
}();

}  // namespace
}  // namespace visual_localization
